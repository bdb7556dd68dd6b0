// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/sheet_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace tenter {
namespace {

double smallestAngle_deg(const SheetMesh& sheet) {
  double smallest = 180.0;
  for (const Triangle& t : sheet.rest.triangles) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = sheet.rest.positions.col(t[(k + 1) % 3]) - sheet.rest.positions.col(t[k]);
      const Vec3 b = sheet.rest.positions.col(t[(k + 2) % 3]) - sheet.rest.positions.col(t[k]);
      smallest =
          std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi);
    }
  }
  return smallest;
}

TEST(GridSheetTest, NodesTrianglesAndArea) {
  for (const DiagonalPattern pattern : {DiagonalPattern::kUniform, DiagonalPattern::kAlternating}) {
    const SheetMesh sheet = gridSheet({0.1, 0.2}, 5, 9, pattern);
    EXPECT_EQ(sheet.nodeCount(), 45);
    EXPECT_EQ(sheet.triangleCount(), 64);
    EXPECT_NEAR(sheet.area(), 0.02, 1e-15);
    EXPECT_TRUE(sheet.rest.uv.col(sheet.grid->node(4, 8)).isApprox(Vec2(0.1, 0.2)));
    EXPECT_TRUE(validateMesh(sheet.rest).ok());
  }
  EXPECT_EQ(gridSheet({1, 1}, 25, 25, DiagonalPattern::kUniform).pattern, "grid 25x25 uniform");
  EXPECT_THROW(gridSheet({0.1, 0.1}, 1, 5, DiagonalPattern::kUniform), std::invalid_argument);
}

TEST(LinesThroughTest, HitStopsAndStayEven) {
  const std::vector<double> lines = linesThrough(0.0, 0.1, 25, {0.013, 0.0871, 0.05});
  ASSERT_EQ(lines.size(), 25U);
  for (const double stop : {0.0, 0.013, 0.05, 0.0871, 0.1}) {
    EXPECT_EQ(std::count(lines.begin(), lines.end(), stop), 1) << stop;
  }
  const double even = 0.1 / 24;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    EXPECT_GT(lines[i] - lines[i - 1], 0.5 * even);
    EXPECT_LT(lines[i] - lines[i - 1], 2.0 * even);
  }
}

TEST(LinesThroughTest, NeverDuplicates) {
  const double tiny = 1e-8;
  const std::vector<double> lines = linesThrough(
      -0.05, 0.05, 10, {-0.05, tiny, 0.0, 2 * tiny, 0.05 - tiny, 0.07, -0.0499, -0.0498});
  EXPECT_EQ(lines.front(), -0.05);
  EXPECT_EQ(lines.back(), 0.05);
  EXPECT_EQ(lines.size(), 10U);
  for (std::size_t i = 1; i < lines.size(); ++i) EXPECT_GT(lines[i] - lines[i - 1], 1e-7);
  EXPECT_EQ(linesThrough(0.0, 1.0, 3, {0.2, 0.4, 0.6}).size(), 5U) << "stops need their lines";
}

TEST(UnstructuredSheetTest, IsADelaunayRectangle) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    for (const double edge : {0.02, 0.01, 0.004}) {
      const SheetMesh sheet = unstructuredSheet({0.1, 0.07}, edge, seed);
      EXPECT_NEAR(sheet.area(), 0.007, 1e-15);
      const Result<void> valid = validateMesh(sheet.rest);
      EXPECT_TRUE(valid.ok()) << valid.error().message();
      EXPECT_GE(smallestAngle_deg(sheet), 20.0) << edge << " " << seed;
      for (const MeshEdge& e : sheet.topology.edges) {
        if (e.triangles[1] >= 0) continue;
        const Vec2 middle =
            0.5 * (sheet.rest.uv.col(e.vertices[0]) + sheet.rest.uv.col(e.vertices[1]));
        const Vec2 to_far = Vec2(0.1, 0.07) - middle;
        EXPECT_EQ(std::min({middle[0], middle[1], to_far[0], to_far[1]}), 0.0);
      }
    }
  }
  const SheetMesh a = unstructuredSheet({0.1, 0.1}, 0.01, 7),
                  b = unstructuredSheet({0.1, 0.1}, 0.01, 7);
  EXPECT_EQ(a.rest.uv, b.rest.uv);
  EXPECT_NE(a.rest.uv, unstructuredSheet({0.1, 0.1}, 0.01, 8).rest.uv);
}

TEST(SheetFromMeshTest, MetricFromPositionsDirectionFromUv) {
  TriangleMesh mesh = gridSheet({0.1, 0.1}, 3, 3, DiagonalPattern::kUniform).rest;
  const Mat3 turn = Eigen::AngleAxisd(0.8, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  mesh.positions = turn * mesh.positions;
  mesh.uv *= 2.0;  // Twice too large: lengths must come from positions.
  const SheetMesh sheet = sheetFromMesh(mesh, false).value();
  EXPECT_NEAR(sheet.area(), 0.01, 1e-15);
  for (int t = 0; t < sheet.triangleCount(); ++t) {
    const Triangle& nodes = sheet.rest.triangles[t];
    Eigen::Matrix<double, 3, 2> edges;
    edges << sheet.rest.positions.col(nodes[1]) - sheet.rest.positions.col(nodes[0]),
        sheet.rest.positions.col(nodes[2]) - sheet.rest.positions.col(nodes[0]);
    const Eigen::Matrix<double, 3, 2> frame = edges * sheet.triangles[t].edges_inverse;
    EXPECT_TRUE(frame.isApprox(turn.leftCols<2>(), 1e-12));
  }
}

TEST(SheetFromMeshTest, WithoutUv) {
  TriangleMesh mesh = gridSheet({0.1, 0.05}, 3, 3, DiagonalPattern::kUniform).rest;
  mesh.uv.resize(2, 0);
  const SheetMesh flat = sheetFromMesh(mesh, false).value();
  EXPECT_TRUE(flat.rest.uv.isApprox(mesh.positions.topRows<2>(), 1e-12));
  mesh.positions(2, 4) = 0.02;
  const auto curved = sheetFromMesh(mesh, false);
  ASSERT_FALSE(curved.ok());
  EXPECT_EQ(curved.error().place, "uv");
  const auto isotropic = sheetFromMesh(mesh, true);
  ASSERT_TRUE(isotropic.ok());
  EXPECT_TRUE(isotropic->rest.hasUv());
  EXPECT_GT(isotropic->area(), 0.005);
}

TEST(SheetFromMeshTest, RefusesUvWithoutArea) {
  TriangleMesh mesh = gridSheet({0.1, 0.05}, 3, 3, DiagonalPattern::kUniform).rest;
  mesh.uv.row(1).setZero();
  const auto sheet = sheetFromMesh(mesh, false);
  ASSERT_FALSE(sheet.ok());
  EXPECT_EQ(sheet.error().place, "triangle 0");
}

}  // namespace
}  // namespace tenter
