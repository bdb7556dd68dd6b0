// SPDX-License-Identifier: GPL-3.0-or-later
#include "height_field.h"

#include <algorithm>
#include <cmath>

#include "tenter/core/median.h"

namespace tenter {

namespace {

constexpr int kMaxCells = 2000;  ///< A side.
/// A cell may depart from the median around it by so many cells' sides.
constexpr double kSteepest = 2.0;
constexpr std::size_t kLeastAround = 3, kClosing = 5;

}  // namespace

HeightField::HeightField(const std::vector<Vec3>& points, double cell_m) : cell_m_(cell_m) {
  Vec2 least = Vec2::Constant(1e300), most = Vec2::Constant(-1e300);
  for (const Vec3& point : points) {
    least = least.cwiseMin(point.head<2>());
    most = most.cwiseMax(point.head<2>());
  }
  if (points.empty()) least = most = Vec2::Zero();
  origin_ = least;
  cell_m_ = std::max(cell_m_, (most - least).maxCoeff() / kMaxCells);
  columns_ = static_cast<int>((most.x() - least.x()) / cell_m_) + 1;
  rows_ = static_cast<int>((most.y() - least.y()) / cell_m_) + 1;
  const auto cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  std::vector<std::vector<double>> inside(cells);
  for (const Vec3& point : points) {
    const Vec2 cell = (point.head<2>() - origin_) / cell_m_;
    inside[static_cast<std::size_t>(index(static_cast<int>(cell.x()), static_cast<int>(cell.y())))]
        .push_back(point.z());
  }
  heights_.resize(cells);
  known_.resize(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    if (inside[i].empty()) continue;
    heights_[i] = medianOf(inside[i]);
    known_[i] = 1;
  }
  dropOutliers();
  closeHoles();
  smooth();
}

std::vector<double> HeightField::knownAround(int column, int row, int reach) const {
  std::vector<double> values;
  for (int r = row - reach; r <= row + reach; ++r) {
    for (int c = column - reach; c <= column + reach; ++c) {
      if ((r != row || c != column) && knownCell(c, r)) values.push_back(heights_[index(c, r)]);
    }
  }
  return values;
}

void HeightField::dropOutliers() {
  std::vector<std::uint8_t> kept = known_;
  for (int r = 0; r < rows_; ++r) {
    for (int c = 0; c < columns_; ++c) {
      if (!knownCell(c, r)) continue;
      std::vector<double> around = knownAround(c, r, 2);
      const bool good = around.size() >= kLeastAround &&
                        std::abs(medianOf(around) - heights_[index(c, r)]) <= kSteepest * cell_m_;
      if (!good) kept[static_cast<std::size_t>(index(c, r))] = 0;
    }
  }
  known_ = std::move(kept);
}

void HeightField::closeHoles() {
  const HeightField before = *this;
  for (int r = 0; r < rows_; ++r) {
    for (int c = 0; c < columns_; ++c) {
      if (before.knownCell(c, r)) continue;
      std::vector<double> around = before.knownAround(c, r, 1);
      if (around.size() < kClosing) continue;
      heights_[index(c, r)] = medianOf(around);
      known_[static_cast<std::size_t>(index(c, r))] = 1;
    }
  }
}

void HeightField::smooth() {
  const HeightField before = *this;
  for (int r = 0; r < rows_; ++r) {
    for (int c = 0; c < columns_; ++c) {
      if (!before.knownCell(c, r)) continue;
      double sum = 0.0, weights = 0.0;
      // Opposite neighbours count only together, so that a slope at a border stays one.
      for (int dr = -1; dr <= 1; ++dr) {
        for (int dc = -1; dc <= 1; ++dc) {
          if (!before.knownCell(c + dc, r + dr) || !before.knownCell(c - dc, r - dr)) continue;
          const double weight = (dr == 0 ? 2.0 : 1.0) * (dc == 0 ? 2.0 : 1.0);
          sum += weight * before.heights_[index(c + dc, r + dr)];
          weights += weight;
        }
      }
      heights_[index(c, r)] = sum / weights;
    }
  }
}

void HeightField::keepLargest() {
  std::vector<int> label(known_.size(), -1), sizes;
  for (int start = 0; start < static_cast<int>(known_.size()); ++start) {
    if (known_[start] == 0 || label[start] >= 0) continue;
    const int piece = static_cast<int>(sizes.size());
    sizes.push_back(0);
    std::vector<int> open = {start};
    label[start] = piece;
    while (!open.empty()) {
      const int at = open.back();
      open.pop_back();
      ++sizes[piece];
      const int c = at % columns_, r = at / columns_;
      for (const auto& [dc, dr] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (!knownCell(c + dc, r + dr)) continue;
        const int other = index(c + dc, r + dr);
        if (label[other] >= 0) continue;
        label[other] = piece;
        open.push_back(other);
      }
    }
  }
  if (sizes.empty()) return;
  const auto largest =
      static_cast<int>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  for (std::size_t i = 0; i < known_.size(); ++i) known_[i] = label[i] == largest ? 1 : 0;
}

bool HeightField::knows(const Vec2& place_m) const {
  const Vec2 cell = (place_m - origin_) / cell_m_;
  return knownCell(static_cast<int>(std::floor(cell.x())), static_cast<int>(std::floor(cell.y())));
}

std::optional<HeightField::Tangent> HeightField::at(const Vec2& place_m) const {
  const Vec2 cell = (place_m - origin_) / cell_m_;
  const int c = static_cast<int>(std::floor(cell.x())), r = static_cast<int>(std::floor(cell.y()));
  if (!knownCell(c, r)) return std::nullopt;
  const double here = heights_[index(c, r)];
  const auto slope = [&](int dc, int dr) {
    const bool ahead = knownCell(c + dc, r + dr), behind = knownCell(c - dc, r - dr);
    const double front = ahead ? heights_[index(c + dc, r + dr)] : here;
    const double back = behind ? heights_[index(c - dc, r - dr)] : here;
    const int steps = static_cast<int>(ahead) + static_cast<int>(behind);
    return steps > 0 ? (front - back) / (steps * cell_m_) : 0.0;
  };
  Tangent tangent{here, Vec2(slope(1, 0), slope(0, 1))};
  const Vec2 centre = origin_ + cell_m_ * Vec2(c + 0.5, r + 0.5);
  tangent.height_m += tangent.slope.dot(place_m - centre);
  return tangent;
}

}  // namespace tenter
