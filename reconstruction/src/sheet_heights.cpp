// SPDX-License-Identifier: GPL-3.0-or-later
#include "sheet_heights.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "height_filter.h"
#include "tenter/core/median.h"

namespace tenter {

namespace {

/// What a vertex may depart from the median of its neighbours, which their slopes carry to it: in
/// their spread, in its sigma and in pixels.
constexpr double kSpreads = 5.0, kSigmas = 5.0, kFixed_px = 0.15;
constexpr std::size_t kLeastNeighbours = 3;
constexpr int kLeastForQuadric = 12;
/// Nodes each way in which a plane or quadric is looked for that leads to a node without a match,
/// and how many of them say how it lies.
constexpr std::array kPlaneReaches = {3, 5, 8, 12};
constexpr int kLeastForPlane = 25;
/// Below this all of them lie on one line.
constexpr double kLeastPlaneRcond = 1e-4;
/// A quadric leads there where what a plane leaves is more than this many times what it leaves: far
/// from its nodes it errs more than a plane, unless they say that the surface is curved.
constexpr double kCurved = 1.5;

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// Of a node so many columns and rows off the middle of a quadric.
struct QuadricTerms {
  double weight;
  Vec6 terms;

  QuadricTerms(int column, int row, int reach) {
    const double x = static_cast<double>(column) / (reach + 1);
    const double y = static_cast<double>(row) / (reach + 1);
    weight = (1.0 - x * x) * (1.0 - y * y);
    terms << 1.0, x, y, x * x, x * y, y * y;
  }
};

}  // namespace

Eigen::MatrixXd quadricWeights(int reach) {
  Mat6 normal = Mat6::Zero();
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) {
      const QuadricTerms at(i, j, reach);
      normal.noalias() += at.weight * at.terms * at.terms.transpose();
    }
  }
  const Vec6 first = normal.ldlt().solve(Vec6::Unit(0));
  Eigen::MatrixXd weights(2 * reach + 1, 2 * reach + 1);
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) {
      const QuadricTerms at(i, j, reach);
      weights(i + reach, j + reach) = at.weight * first.dot(at.terms);
    }
  }
  return weights;
}

SheetHeights::SheetHeights(const SheetGrid& grid, const HeightField& coarse)
    : grid_(grid),
      heights_(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows)),
      known_(heights_.size()),
      matched_(heights_.size()) {
  for (int node = 0; node < static_cast<int>(heights_.size()); ++node) {
    const auto tangent = coarse.at(grid.place(node));
    if (!tangent) continue;
    heights_[node] = tangent->height_m;
    known_[node] = 1;
  }
  fill();
}

std::vector<int> SheetHeights::around(int node, int reach) const {
  const int column = node % grid_.columns, row = node / grid_.columns;
  std::vector<int> nodes;
  for (int r = std::max(row - reach, 0); r <= std::min(row + reach, grid_.rows - 1); ++r) {
    for (int c = std::max(column - reach, 0); c <= std::min(column + reach, grid_.columns - 1);
         ++c) {
      const int other = r * grid_.columns + c;
      if (other != node && known(other)) nodes.push_back(other);
    }
  }
  return nodes;
}

Vec2 SheetHeights::slope(int node) const {
  const int column = node % grid_.columns, row = node / grid_.columns;
  const auto along = [&](int place, int count, int stride, double spacing) {
    const bool ahead = place + 1 < count && known(node + stride);
    const bool behind = place > 0 && known(node - stride);
    const int steps = static_cast<int>(ahead) + static_cast<int>(behind);
    if (steps == 0) return 0.0;
    const double rise =
        heights_[ahead ? node + stride : node] - heights_[behind ? node - stride : node];
    return rise / (steps * spacing);
  };
  return {along(column, grid_.columns, 1, grid_.spacing_m.x()),
          along(row, grid_.rows, grid_.columns, grid_.spacing_m.y())};
}

double SheetHeights::extrapolated(int column, int row) const {
  if (column < 0) return 2.0 * extrapolated(0, row) - extrapolated(1, row);
  if (row < 0) return 2.0 * extrapolated(column, 0) - extrapolated(column, 1);
  const int last_column = grid_.columns - 1, last_row = grid_.rows - 1;
  if (column > last_column) {
    return 2.0 * extrapolated(last_column, row) - extrapolated(last_column - 1, row);
  }
  if (row > last_row) {
    return 2.0 * extrapolated(column, last_row) - extrapolated(column, last_row - 1);
  }
  return heights_[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.columns) + column];
}

int SheetHeights::nodeNear(const Vec2& place_m) const {
  const Vec2 cell = (place_m - grid_.origin_m).cwiseQuotient(grid_.spacing_m);
  const int column = std::clamp(static_cast<int>(std::lround(cell.x())), 0, grid_.columns - 1);
  const int row = std::clamp(static_cast<int>(std::lround(cell.y())), 0, grid_.rows - 1);
  return row * grid_.columns + column;
}

SurfaceElement SheetHeights::elementAt(const Vec2& place_m) const {
  const int node = nodeNear(place_m);
  const Vec2 rise = slope(node);
  const double height = heights_[node] + rise.dot(place_m - grid_.place(node));
  const Mat3& turn = grid_.space_from_sheet.linear();
  SurfaceElement element;
  element.point_m = grid_.space_from_sheet * Vec3(place_m.x(), place_m.y(), height);
  element.tangents.col(0) = turn * Vec3(1.0, 0.0, rise.x());
  element.tangents.col(1) = turn * Vec3(0.0, 1.0, rise.y());
  return element;
}

void SheetHeights::refine(std::vector<RestVertex>& vertices, double pixel_m) {
  const Eigen::Isometry3d sheet_from_space = grid_.space_from_sheet.inverse();
  const SheetHeights before = *this;
  for (int node = 0; node < static_cast<int>(vertices.size()); ++node) {
    known_[node] = 0;
    if (vertices[node].state != PointState::kValid) continue;
    const Vec3 at = sheet_from_space * vertices[node].point.position_m;
    const Vec2 off = at.head<2>() - grid_.place(node);
    heights_[node] = at.z() - before.slope(node).dot(off);
    known_[node] = 1;
  }
  dropOutliers(vertices, pixel_m);
  matched_ = known_;
  fill();
}

QuadricEquations SheetHeights::equationsAround(int node, int reach, double base) const {
  QuadricEquations equations;
  const int column = node % grid_.columns, row = node / grid_.columns;
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) {
      const int c = column + i, r = row + j;
      if (c < 0 || r < 0 || c >= grid_.columns || r >= grid_.rows) continue;
      const int other = r * grid_.columns + c;
      if (!known(other)) continue;
      const QuadricTerms at(i, j, reach);
      const double height = heights_[other] - base;
      equations.normal.noalias() += at.weight * at.terms * at.terms.transpose();
      equations.right += at.weight * height * at.terms;
      equations.squares += at.weight * height * height;
      ++equations.count;
    }
  }
  return equations;
}

double SheetHeights::quadricAt(int node, int reach) const {
  const QuadricEquations equations = equationsAround(node, reach, 0.0);
  if (equations.count < kLeastForQuadric) return heights_[node];
  const Eigen::LDLT<Mat6> factors(equations.normal);
  const double height = factors.solve(equations.right)[0];
  return factors.info() == Eigen::Success && std::isfinite(height) ? height : heights_[node];
}

SheetHeights SheetHeights::smoothed(int reach) const {
  SheetHeights out = *this;
  for (int node = 0; node < static_cast<int>(heights_.size()); ++node) {
    if (known(node)) out.heights_[node] = quadricAt(node, reach);
  }
  return out;
}

SheetHeights SheetHeights::seenBySubsets(const SubsetWeights& subset, int order) const {
  SheetHeights out = *this;
  for (int node = 0; node < static_cast<int>(heights_.size()); ++node) {
    if (!known(node)) continue;
    const int column = node % grid_.columns, row = node / grid_.columns;
    double seen = 0.0;
    for (int j = -subset.half; j <= subset.half; ++j) {
      const std::size_t y = static_cast<std::size_t>(j + subset.half);
      for (int i = -subset.half; i <= subset.half; ++i) {
        const std::size_t x = static_cast<std::size_t>(i + subset.half);
        double weight = subset.mean[x] * subset.mean[y];
        if (order > 1)
          weight =
              subset.quadratic[x] * subset.mean[y] + subset.mean[x] * subset.quadratic[y] - weight;
        seen += weight * extrapolated(column + i, row + j);
      }
    }
    out.heights_[node] = seen;
  }
  return out;
}

void SheetHeights::dropOutliers(std::vector<RestVertex>& vertices, double pixel_m) {
  std::vector<int> outliers;
  for (int node = 0; node < static_cast<int>(vertices.size()); ++node) {
    if (!known(node)) continue;
    std::vector<double> predicted;
    for (const int other : around(node, 2)) {
      predicted.push_back(heights_[other] +
                          slope(other).dot(grid_.place(node) - grid_.place(other)));
    }
    bool good = predicted.size() >= kLeastNeighbours;
    if (good) {
      const double centre = medianOf(predicted);
      for (double& value : predicted) value = std::abs(value - centre);
      const double sigma = std::sqrt(vertices[node].point.covariance_m2.trace());
      const double allowed = kSpreads * medianOf(predicted) + kSigmas * sigma + kFixed_px * pixel_m;
      good = std::abs(heights_[node] - centre) <= allowed;
    }
    if (!good) outliers.push_back(node);
  }
  for (const int node : outliers) {
    known_[node] = 0;
    vertices[node].state = PointState::kOutlier;
  }
}

std::optional<double> SheetHeights::carriedTo(int node, int reach) const {
  const std::vector<int> near = around(node, reach);
  if (static_cast<int>(near.size()) < kLeastForPlane) return std::nullopt;
  const double base = heights_[near.front()];  // so that squares are of differences
  const auto [normal, right, squares, count] = equationsAround(node, reach, base);
  const Eigen::LDLT<Mat3> plane(normal.topLeftCorner<3, 3>());
  if (plane.info() != Eigen::Success || plane.rcond() < kLeastPlaneRcond) return std::nullopt;
  const Vec3 by_plane = plane.solve(right.head<3>());
  const double off_plane = squares - right.head<3>().dot(by_plane);
  const Eigen::LDLT<Mat6> quadric(normal);
  const Vec6 by_quadric = quadric.solve(right);
  const double off_quadric = squares - right.dot(by_quadric);
  const bool curved = quadric.info() == Eigen::Success && quadric.rcond() > kLeastPlaneRcond &&
                      by_quadric.allFinite() && off_plane > kCurved * off_quadric;
  return base + (curved ? by_quadric[0] : by_plane[0]);
}

/// Nodes near known ones lie where a plane or a quadric through many of those leads: the slope
/// between two of them, which err by micrometres, is off by tenths of a millimetre a few nodes
/// away. From there the known nodes grow outwards, each new one where the planes of those around it
/// lead.
void SheetHeights::fill() {
  const SheetHeights given = *this;
  for (int node = 0; node < static_cast<int>(heights_.size()); ++node) {
    if (given.known(node)) continue;
    for (const int reach : kPlaneReaches) {
      const auto height = given.carriedTo(node, reach);
      if (!height) continue;
      heights_[node] = *height;
      known_[node] = 1;
      break;
    }
  }
  for (bool grown = true; grown;) {
    const SheetHeights before = *this;
    grown = false;
    for (int node = 0; node < static_cast<int>(heights_.size()); ++node) {
      if (before.known(node)) continue;
      const std::vector<int> near = before.around(node, 1);
      if (near.size() < 2) continue;
      double sum = 0.0;
      for (const int other : near) {
        sum += before.heights_[other] +
               before.slope(other).dot(grid_.place(node) - grid_.place(other));
      }
      heights_[node] = sum / static_cast<double>(near.size());
      known_[node] = 1;
      grown = true;
    }
  }
}

}  // namespace tenter
