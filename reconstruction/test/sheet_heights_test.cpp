// SPDX-License-Identifier: GPL-3.0-or-later
#include "sheet_heights.h"

#include <gtest/gtest.h>

#include <random>

namespace tenter {
namespace {

constexpr int kNodes = 40;
constexpr double kSpacing_m = 1e-3, kNoise_m = 5e-6;

/// Tilted by 2 and 1 percent.
double planeAt(const Vec2& place_m) { return 1e-3 + 0.02 * place_m.x() + 0.01 * place_m.y(); }

SheetGrid squareGrid() {
  SheetGrid grid;
  grid.spacing_m = Vec2::Constant(kSpacing_m);
  grid.columns = grid.rows = kNodes;
  return grid;
}

HeightField coarsePlane(const SheetGrid& grid) {
  std::vector<Vec3> points;
  for (int node = 0; node < kNodes * kNodes; ++node) {
    const Vec2 at = grid.place(node);
    points.emplace_back(at.x(), at.y(), planeAt(at));
  }
  return {points, kSpacing_m};
}

/// Matched but for nodes for which `missing` says so; heights err independently.
std::vector<RestVertex> matches(const SheetGrid& grid,
                                const std::function<bool(int column, int row)>& missing) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, kNoise_m);
  std::vector<RestVertex> vertices(kNodes * kNodes);
  for (int node = 0; node < kNodes * kNodes; ++node) {
    const Vec2 at = grid.place(node);
    const double height = planeAt(at) + noise(random);
    if (missing(node % kNodes, node / kNodes)) continue;
    vertices[node].state = PointState::kValid;
    vertices[node].point.position_m = Vec3(at.x(), at.y(), height);
    vertices[node].point.covariance_m2 = kNoise_m * kNoise_m * Mat3::Identity();
  }
  return vertices;
}

double worstError(const SheetGrid& grid, const SheetHeights& heights) {
  double worst = 0.0;
  for (int node = 0; node < heights.count(); ++node) {
    EXPECT_TRUE(heights.known(node)) << node;
    worst = std::max(worst, std::abs(heights.height(node) - planeAt(grid.place(node))));
  }
  return worst;
}

/// Corners of a sample are never matched: no subset lies within it there.
TEST(SheetHeights, CornersWithoutMatchesLieWhereThePlaneAroundThemLeads) {
  const SheetGrid grid = squareGrid();
  SheetHeights heights(grid, coarsePlane(grid));
  std::vector<RestVertex> vertices = matches(grid, [](int column, int row) {
    const int from_corner =
        std::max(std::min(column, kNodes - 1 - column), std::min(row, kNodes - 1 - row));
    return from_corner < 5;
  });
  heights.refine(vertices, kSpacing_m / 4);
  EXPECT_LT(worstError(grid, heights), 5.0 * kNoise_m);
}

TEST(SheetHeights, ALargeHoleIsFilledToItsMiddle) {
  const SheetGrid grid = squareGrid();
  SheetHeights heights(grid, coarsePlane(grid));
  std::vector<RestVertex> vertices =
      matches(grid, [](int column, int row) { return std::hypot(column - 20, row - 20) < 15.0; });
  heights.refine(vertices, kSpacing_m / 4);
  EXPECT_LT(worstError(grid, heights), 0.1e-3);
}

}  // namespace
}  // namespace tenter
