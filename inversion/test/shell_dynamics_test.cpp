// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/shell_dynamics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "shell_samples.h"
#include "tenter/inversion/inversion.h"

namespace tenter {
namespace {

using test::shellMaterial;

/// The two constants of [Inv18] at its reference, times `factor`.
ShellMaterial reference(double factor = 1.0) {
  const ClothModel* model = findClothModel("edge-hinge").value();
  std::vector<ComponentCurve> curves(2);
  curves[0].curve = StiffnessCurve::constant(3.0 * factor);
  curves[1].curve = StiffnessCurve::constant(5e-3 * factor);
  return {model, makeLaws(*model, curves), 0.1, kDefaultGravity};
}

DynamicsOptions undamped(double step_s) {
  DynamicsOptions o;
  o.step_s = step_s;
  o.mass_damping_per_s = o.stiffness_damping_s = 0.0;
  return o;
}

/// A flat sheet in the plane through the origin with that slope along x.
TriangleMesh flatSheet(int columns, int rows, double slope = 0.0) {
  TriangleMesh mesh = test::bentTarget(columns, rows);
  const double angle = std::atan(slope);
  for (int v = 0; v < mesh.vertexCount(); ++v) {
    const Vec2 uv = mesh.uv.col(v);
    mesh.positions.col(v) = Vec3(uv[0] * std::cos(angle), uv[1], uv[0] * std::sin(angle));
  }
  return mesh;
}

std::vector<MovingObstacle> floorOf(double slope, double friction) {
  std::vector<MovingObstacle> out(1);
  const double angle = std::atan(slope);
  char plane[100];
  std::snprintf(plane, sizeof plane, "plane:0,0,0,%.17g,0,%.17g", -std::sin(angle),
                std::cos(angle));
  out[0].body = makeObstacle(plane).value();
  out[0].friction = friction;
  return out;
}

TEST(ShellDynamicsTest, AFreeSheetFalls) {
  const TriangleMesh mesh = flatSheet(4, 4);
  const InverseShell shell = InverseShell::create(mesh, reference()).value();
  auto dynamics =
      ShellDynamics::create(shell, {mesh.positions, mesh.positions, {}, {}}, {}, undamped(0.01))
          .value();
  ASSERT_EQ(dynamics.advanceTo(1.0), AdvanceEnd::kReached);
  const Points3 v = dynamics.velocities();
  const Points3 d = dynamics.positions() - mesh.positions;
  for (int i = 0; i < mesh.vertexCount(); ++i) {
    EXPECT_NEAR(v(2, i), -kStandardGravity_m_per_s2, 1e-9);
    // First order in its first step only: half of g dt^2 too far.
    EXPECT_NEAR(d(2, i), -0.5 * kStandardGravity_m_per_s2, 1e-3);
    EXPECT_NEAR(d.col(i).head<2>().norm(), 0.0, 1e-9);
  }
}

class SlopeTest : public testing::TestWithParam<const char*> {};

/// A stiff sheet on a slope, steep by `share` of its friction.
ShellDynamics onSlope(double share, double friction, double step_s) {
  const double slope = share * friction;
  const TriangleMesh mesh = flatSheet(4, 4, slope);
  const InverseShell shell = InverseShell::create(mesh, reference(100.0)).value();
  std::vector<std::unique_ptr<Obstacle>> bodies;
  auto floor = floorOf(slope, friction);
  std::vector<std::unique_ptr<Obstacle>> found;
  found.push_back(std::move(floor[0].body));
  const auto contacts = findContacts(mesh, found, {}, {friction, 0.0}).value();
  floor[0].body = std::move(found[0]);
  EXPECT_EQ(contacts.size(), 16u);
  return ShellDynamics::create(shell, {mesh.positions, mesh.positions, {}, contacts},
                               std::move(floor), undamped(step_s))
      .value();
}

TEST(ShellDynamicsTest, OnASlopeItSticksUpToItsFriction) {
  for (const double friction : {0.1, 0.4, 1.5}) {
    ShellDynamics dynamics = onSlope(0.999, friction, 0.01);
    ASSERT_EQ(dynamics.advanceTo(1.0), AdvanceEnd::kReached);
    EXPECT_LT(dynamics.counts().largest_displacement_m, 1e-8) << friction;
    for (const VertexContact& c : dynamics.contacts()) EXPECT_EQ(c.mode, ContactMode::kStuck);
  }
}

TEST(ShellDynamicsTest, SteeperItSlidesAsABlockDoes) {
  for (const double friction : {0.1, 0.4, 1.5}) {
    for (const double share : {1.001, 1.5}) {
      ShellDynamics dynamics = onSlope(share, friction, 0.01);
      ASSERT_EQ(dynamics.advanceTo(1.0), AdvanceEnd::kReached);
      const double angle = std::atan(share * friction);
      const double acceleration =
          kStandardGravity_m_per_s2 * (std::sin(angle) - friction * std::cos(angle));
      const Vec3 v = dynamics.velocities().rowwise().mean();
      EXPECT_NEAR(v.norm(), acceleration, 1e-3 * acceleration) << friction << " " << share;
      EXPECT_LT(v[2], 0.0);
      for (const VertexContact& c : dynamics.contacts()) EXPECT_EQ(c.mode, ContactMode::kSliding);
      std::printf("mu %g share %g steps %d its %d fact %d rej %d\n", friction, share,
                  dynamics.counts().steps, dynamics.counts().iterations,
                  dynamics.counts().factorizations, dynamics.counts().rejected);
    }
  }
}

}  // namespace
}  // namespace tenter
