// SPDX-License-Identifier: GPL-3.0-or-later
#include "rest_path.h"

#include <gtest/gtest.h>

#include <cmath>

#include "shell_samples.h"

namespace tenter {
namespace {

Points3 turnedBy(const Points3& x, const Vec3& axis, double scale) {
  Points3 d(3, x.cols());
  for (Eigen::Index v = 0; v < x.cols(); ++v) d.col(v) = scale * axis.cross(Vec3(x.col(v)));
  return d;
}

TEST(RestPathTest, ALargeRotationStretchesNothing) {
  const TriangleMesh mesh = test::bentTarget(6, 5);
  const RestPath path(mesh, {});
  const Points3 d = turnedBy(mesh.positions, Vec3(0.6, -0.5, 0.3).normalized(), 1.2);
  const Points3 moved = path.moved(mesh.positions, d);
  const Points3 added = mesh.positions + d;
  for (const Triangle& t : mesh.triangles) {
    const auto length = [&](const Points3& x) { return (x.col(t[1]) - x.col(t[0])).norm(); };
    EXPECT_NEAR(length(moved), length(mesh.positions), 1e-12);
  }
  EXPECT_GT((moved - added).norm(), 0.1);
}

TEST(RestPathTest, IsTheDisplacementToFirstOrderAndKeepsFixedVertices) {
  const TriangleMesh mesh = test::bentTarget(6, 5);
  const std::vector<int> fixed{0, 1, 2, 3, 4, 5};
  const RestPath path(mesh, fixed);
  Points3 d(3, mesh.vertexCount());
  for (Eigen::Index k = 0; k < d.size(); ++k) d.data()[k] = 0.01 * std::sin(1.7 * double(k));
  for (const int v : fixed) d.col(v).setZero();
  const auto error = [&](double t) {
    return (path.moved(mesh.positions, t * d) - mesh.positions - t * d).norm();
  };
  EXPECT_GT(error(1.0), 0.0);
  EXPECT_NEAR(error(1e-2) / error(1e-3), 100.0, 5.0);
  const Points3 moved = path.moved(mesh.positions, d);
  for (const int v : fixed) EXPECT_EQ(moved.col(v), mesh.positions.col(v));
}

}  // namespace
}  // namespace tenter
