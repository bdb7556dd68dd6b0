// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/turning_path.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tenter/mechanics/sheet_mesh.h"

namespace tenter {
namespace {

/// Positions are of the order of one: a few dozen roundings.
constexpr double kRounding = 1e-13;

/// A sheet of 8 x 6 nodes, bent into a quarter of a cylinder.
TriangleMesh bentSheet() {
  TriangleMesh mesh = gridSheet({1.0, 0.6}, 8, 6, DiagonalPattern::kAlternating).rest;
  for (int v = 0; v < mesh.vertexCount(); ++v) {
    const double s = mesh.positions(0, v) * 1.5;
    mesh.positions(0, v) = std::sin(s) / 1.5;
    mesh.positions(2, v) = (1.0 - std::cos(s)) / 1.5;
  }
  return mesh;
}

TEST(TurningPath, CarriesOutARotationAsOne) {
  const TriangleMesh mesh = bentSheet();
  const TurningPath path(mesh, {0});
  const Vec3 turn(0.9, -1.1, 0.4);
  const Vec3 pivot = mesh.positions.col(0);
  const Points3 displacement = (mesh.positions.colwise() - pivot).colwise().cross(-turn);
  const Mat3 rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  const Points3 expected = (rotation * (mesh.positions.colwise() - pivot)).colwise() + pivot;
  EXPECT_LT((path.moved(mesh.positions, displacement) - expected).cwiseAbs().maxCoeff(), kRounding);
}

TEST(TurningPath, IsTheDisplacementToFirstOrder) {
  const TriangleMesh mesh = bentSheet();
  const TurningPath path(mesh, {0, 7});
  Points3 direction = Points3::Zero(3, mesh.vertexCount());
  for (int v = 0; v < mesh.vertexCount(); ++v)
    direction.col(v) = Vec3(std::sin(3.0 * v), std::cos(2.0 * v), std::sin(5.0 * v + 1.0));
  const auto apart = [&](double share) {
    return (path.moved(mesh.positions, share * direction) - mesh.positions - share * direction)
        .norm();
  };
  EXPECT_GT(apart(1e-4), 0.0);
  EXPECT_NEAR(apart(1e-4) / apart(1e-5), 100.0, 1.0);
}

TEST(TurningPath, HeldVerticesMoveByTheDisplacement) {
  const TriangleMesh mesh = bentSheet();
  const TurningPath path(mesh, {3, 40});
  Points3 displacement = Points3::Zero(3, mesh.vertexCount());
  displacement.col(3) = Vec3(0.2, -0.1, 0.3);
  const Points3 moved = path.moved(mesh.positions, displacement);
  EXPECT_EQ(moved.col(3), mesh.positions.col(3) + displacement.col(3));
  EXPECT_EQ(moved.col(40), mesh.positions.col(40));
  EXPECT_TRUE(moved.allFinite());
}

TEST(TurningPath, AFlattenedTriangleIsOnlyDisplaced) {
  TriangleMesh mesh = bentSheet();
  const TurningPath path(mesh, {0});
  Points3 from = mesh.positions;
  for (const int v : mesh.triangles[20]) from.col(v) = from.col(mesh.triangles[20][0]);
  const Points3 displacement = 0.01 * mesh.positions;
  EXPECT_TRUE(path.moved(from, displacement).allFinite());
}

}  // namespace
}  // namespace tenter
