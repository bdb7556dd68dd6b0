// SPDX-License-Identifier: GPL-3.0-or-later
#include "neighbour_lists.h"

#include <algorithm>
#include <cmath>

namespace tenter {

namespace {

constexpr double kPointsPerCell = 2.0;
constexpr int kReach_cells = 3;

/// Points in the cells of a square lattice.
class Lattice {
 public:
  explicit Lattice(const std::vector<Vec2>& points) : points_(points) {
    Vec2 most = points.front();
    least_ = points.front();
    for (const Vec2& point : points) {
      least_ = least_.cwiseMin(point);
      most = most.cwiseMax(point);
    }
    const Vec2 size = most - least_;
    const double count = static_cast<double>(points.size());
    // The second bound is for points on a line.
    cell_px_ = std::max({std::sqrt(kPointsPerCell * size.x() * size.y() / count),
                         kPointsPerCell * size.maxCoeff() / count, 1e-3});
    columns_ = static_cast<int>(size.x() / cell_px_) + 1;
    rows_ = static_cast<int>(size.y() / cell_px_) + 1;
    cells_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    for (int i = 0; i < static_cast<int>(points.size()); ++i) {
      cells_[index(column(points[i]), row(points[i]))].push_back(i);
    }
  }

  std::vector<int> nearest(int i, std::size_t count) const {
    const Vec2& centre = points_[i];
    std::vector<int> around;
    for (int r = row(centre) - kReach_cells; r <= row(centre) + kReach_cells; ++r) {
      for (int c = column(centre) - kReach_cells; c <= column(centre) + kReach_cells; ++c) {
        if (r < 0 || c < 0 || r >= rows_ || c >= columns_) continue;
        for (const int other : cells_[index(c, r)]) {
          if (other != i) around.push_back(other);
        }
      }
    }
    const auto kept = std::min(count, around.size());
    std::partial_sort(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(kept),
                      around.end(), [&](int left, int right) {
                        const double a = (points_[left] - centre).squaredNorm();
                        const double b = (points_[right] - centre).squaredNorm();
                        return a != b ? a < b : left < right;
                      });
    around.resize(kept);
    return around;
  }

 private:
  int column(const Vec2& point) const {
    return std::min(static_cast<int>((point.x() - least_.x()) / cell_px_), columns_ - 1);
  }
  int row(const Vec2& point) const {
    return std::min(static_cast<int>((point.y() - least_.y()) / cell_px_), rows_ - 1);
  }
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + column;
  }

  const std::vector<Vec2>& points_;
  Vec2 least_;
  double cell_px_ = 1.0;
  int columns_ = 1, rows_ = 1;
  std::vector<std::vector<int>> cells_;
};

}  // namespace

std::vector<std::vector<int>> neighbourLists(const std::vector<Vec2>& points, std::size_t count) {
  std::vector<std::vector<int>> lists(points.size());
  if (points.empty()) return lists;
  const Lattice lattice(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    lists[i] = lattice.nearest(static_cast<int>(i), count);
  }
  return lists;
}

}  // namespace tenter
