// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/shell_dynamics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "shell_samples.h"
#include "soft_modes.h"
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
      EXPECT_EQ(dynamics.counts().steps, 100);
      EXPECT_LE(dynamics.counts().iterations, 400) << "Newton's method converges at once";
    }
  }
}

TEST(ShellDynamicsTest, AMovingFloorCarriesTheSheetOnceItHasCaughtUp) {
  const TriangleMesh mesh = flatSheet(4, 4);
  const InverseShell shell = InverseShell::create(mesh, reference(100.0)).value();
  const double friction = 0.4, speed = 0.2;
  std::vector<Contact> contacts;
  for (int v = 0; v < mesh.vertexCount(); ++v) contacts.push_back({v, Vec3::UnitZ(), friction});
  auto floor = floorOf(0.0, friction);
  floor[0].motion.velocity_m_per_s = Vec3(speed, 0.0, 0.0);
  const double step_s = 1e-3;
  auto dynamics = ShellDynamics::create(shell, {mesh.positions, mesh.positions, {}, contacts},
                                        std::move(floor), undamped(step_s))
                      .value();
  const double caught_up_s = speed / (friction * kStandardGravity_m_per_s2);
  ASSERT_EQ(dynamics.advanceTo(0.5 * caught_up_s), AdvanceEnd::kReached);
  for (const VertexContact& c : dynamics.contacts()) EXPECT_EQ(c.mode, ContactMode::kSliding);
  EXPECT_NEAR(dynamics.velocities().rowwise().mean()[0], 0.5 * speed, 1e-3 * speed);
  ASSERT_EQ(dynamics.advanceTo(0.5), AdvanceEnd::kReached);
  for (const VertexContact& c : dynamics.contacts()) EXPECT_EQ(c.mode, ContactMode::kStuck);
  const Points3 velocity = dynamics.velocities();
  const Points3 moved = dynamics.positions() - mesh.positions;
  for (int v = 0; v < mesh.vertexCount(); ++v) {
    EXPECT_NEAR((velocity.col(v) - Vec3(speed, 0.0, 0.0)).norm(), 0.0, 1e-8);
    EXPECT_NEAR(moved(0, v), speed * (0.5 - 0.5 * caught_up_s), speed * step_s);
    EXPECT_NEAR(moved(2, v), 0.0, 1e-9);
  }
}

/// A strip held by two rows at one end, without weight.
struct Strip {
  TriangleMesh mesh = flatSheet(9, 3);
  std::vector<int> fixed;
  InverseShell shell;
  Strip() : shell(makeShell(mesh)) {
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 2; ++column) fixed.push_back(9 * row + column);
  }
  static InverseShell makeShell(const TriangleMesh& mesh) {
    ShellMaterial material = reference(10.0);
    material.gravity_m_per_s2.setZero();
    return InverseShell::create(mesh, material).value();
  }
};

TEST(ShellDynamicsTest, AStripSwingsWithThePeriodOfItsLowestMode) {
  const Strip strip;
  const Points3& rest = strip.mesh.positions;
  const ClothSystem system = strip.shell.system(rest, strip.fixed).value();
  const SparseLower h = system.hessian(system.restState(), Projection::kNone);
  SparseCholesky cholesky(h);
  const Eigen::VectorXd mass = system.dofMass();
  const SoftModes modes = softModes(h, mass, cholesky, 2);
  const Eigen::VectorXd mode = modes.vectors.col(0);
  Eigen::VectorXd stiff;
  multiply(h, mode, stiff);
  const double period_s =
      2.0 * std::numbers::pi / std::sqrt(mode.dot(stiff) / mode.dot(mass.cwiseProduct(mode)));
  auto dynamics = ShellDynamics::create(strip.shell, {rest, rest, strip.fixed, {}}, {},
                                        undamped(period_s / 200.0))
                      .value();
  Points3 shape = Points3::Zero(3, rest.cols());
  Eigen::Index next = 0;
  for (int v = 0; v < rest.cols(); ++v) {
    if (std::find(strip.fixed.begin(), strip.fixed.end(), v) != strip.fixed.end()) continue;
    shape.col(v) = mode.segment<3>(next);
    next += 3;
  }
  shape *= 1e-4 * sizeOf(rest) / shape.cwiseAbs().maxCoeff();
  dynamics.displace(shape);
  // Where the swing passes through zero: after a quarter and three quarters of a period, ...
  std::vector<double> zeros_s;
  double before = shape.squaredNorm(), before_s = 0.0;
  while (zeros_s.size() < 9) {
    const double now_s = before_s + period_s / 200.0;
    ASSERT_EQ(dynamics.advanceTo(now_s), AdvanceEnd::kReached);
    const double now = shape.cwiseProduct(dynamics.positions() - rest).sum();
    if (before * now < 0.0)
      zeros_s.push_back(before_s + (now_s - before_s) * before / (before - now));
    before = now;
    before_s = now_s;
  }
  EXPECT_NEAR((zeros_s[8] - zeros_s[0]) / 4.0, period_s, 1e-3 * period_s);
  EXPECT_EQ(dynamics.counts().rejected, 0);
}

TEST(ShellDynamicsTest, EnergyDoesNotGrow) {
  const TriangleMesh mesh = flatSheet(6, 6);
  const InverseShell shell = InverseShell::create(mesh, reference()).value();
  double lost[2];
  for (const bool second_order : {false, true}) {
    DynamicsOptions options = undamped(2e-3);
    options.second_order = second_order;
    auto dynamics =
        ShellDynamics::create(shell, {mesh.positions, mesh.positions, {0, 5}, {}}, {}, options)
            .value();
    const double start = dynamics.energy_J();
    double last = start;
    for (int k = 1; k <= 50; ++k) {
      ASSERT_EQ(dynamics.advanceTo(0.01 * k), AdvanceEnd::kReached);
      const double now = dynamics.energy_J();
      EXPECT_LE(now, (second_order ? start : last) + 1e-9);
      last = now;
    }
    EXPECT_GT(dynamics.kineticEnergy_J(), 0.0);
    lost[second_order ? 1 : 0] = start - last;
  }
  EXPECT_LT(lost[1], 0.5 * lost[0]);
}

TEST(ShellDynamicsTest, ASheetLandsOnASphereWithoutGoingIn) {
  TriangleMesh mesh = flatSheet(12, 12);
  mesh.positions.row(2).array() += 0.13;
  mesh.positions.row(0).array() -= 0.22;
  mesh.positions.row(1).array() -= 0.22;
  const InverseShell shell = InverseShell::create(mesh, reference()).value();
  std::vector<MovingObstacle> ball(1);
  ball[0].body = makeObstacle("sphere:0,0,0,0.1").value();
  ball[0].friction = 0.5;
  DynamicsOptions options;
  auto dynamics = ShellDynamics::create(shell, {mesh.positions, mesh.positions, {}, {}},
                                        std::move(ball), options)
                      .value();
  ASSERT_EQ(dynamics.advanceTo(0.5), AdvanceEnd::kReached);
  int touching = 0;
  const Points3 x = dynamics.positions();
  for (int v = 0; v < x.cols(); ++v) {
    touching += dynamics.contacts()[static_cast<std::size_t>(v)].mode != ContactMode::kOff;
    EXPECT_GT(x.col(v).norm(), 0.1 - 1e-4 * sizeOf(mesh.positions));
  }
  EXPECT_GE(touching, 3);
  EXPECT_LE(dynamics.counts().worst_residual_N, 1e3 * dynamics.tolerance_N());
}

}  // namespace
}  // namespace tenter
