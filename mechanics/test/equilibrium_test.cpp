// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/equilibrium.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tenter {
namespace {

std::vector<ComponentCurve> constants(const ClothModel& model, const std::vector<double>& values) {
  std::vector<ComponentCurve> components(values.size());
  for (std::size_t c = 0; c < values.size(); ++c) {
    components[c].curve =
        StiffnessCurve::constant(values[c], model.component(static_cast<int>(c)).even);
  }
  return components;
}

ClothSystem makeSystem(const char* id, SheetMesh sheet, const std::vector<double>& values,
                       SystemSetup setup) {
  const ClothModel& model = **findClothModel(id);
  auto system = ClothSystem::create(std::move(sheet), model,
                                    makeLaws(model, constants(model, values)), std::move(setup));
  if (!system) throw std::runtime_error(system.error().message());
  return std::move(*system);
}

/// Strip along u, ends held in clips 0 and 1.
SystemSetup clampedEnds(const SheetMesh& sheet) {
  SystemSetup setup;
  setup.gravity_m_per_s2.setZero();
  setup.areal_density_kg_per_m2 = 0.1;
  setup.clips.resize(2);
  const GridLines& grid = *sheet.grid;
  const int last = static_cast<int>(grid.u_lines.size()) - 1;
  for (int j = 0; j < static_cast<int>(grid.v_lines.size()); ++j) {
    setup.clips[0].nodes.push_back(grid.node(0, j));
    setup.clips[1].nodes.push_back(grid.node(last, j));
  }
  return setup;
}

TEST(Equilibrium, UniaxialStripCarriesTheClosedFormForce) {
  const double stretch = 1.1, width = 0.02, k = 500.0;
  SheetMesh sheet = gridSheet({0.1, width}, 11, 3, DiagonalPattern::kUniform);
  SystemSetup setup = clampedEnds(sheet);
  setup.planar = true;
  const ClothSystem system = makeSystem("stvk", sheet, {k, 300.0, 100.0, 0.0, 0.0, 0.0}, setup);
  ClothState state = system.restState();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation().x() = 0.1 * (stretch - 1.0);
  system.setClipPose(state, 1, pose);
  EquilibriumSolver solver(system);
  const EquilibriumSummary summary = solver.solve(state);
  ASSERT_TRUE(summary.converged()) << describe(summary.termination);
  EXPECT_TRUE(summary.stable);
  // First Piola stress of the diagonal StVK law: lambda k (lambda^2 - 1)/2 per unit width.
  const double expected = stretch * k * (stretch * stretch - 1.0) / 2.0 * width;
  EXPECT_NEAR(-system.clipWrench(state, 1).force_N.x() / expected, 1.0, 1e-6);
}

TEST(Equilibrium, SimpleShearCarriesTheClosedFormForce) {
  const double gamma = 0.2, g = 80.0;
  SheetMesh sheet = gridSheet({0.1, 0.1}, 9, 9, DiagonalPattern::kUniform);
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = 0.1;
  setup.planar = true;
  setup.clips.resize(2);
  // Bottom row and the sides are carried along affinely: fix all boundary nodes, the top row is the
  // clip that is read.
  for (int j = 0; j < 9; ++j) {
    for (int i = 0; i < 9; ++i) {
      const bool top = j == 8, boundary = i == 0 || i == 8 || j == 0;
      if (top) setup.clips[1].nodes.push_back(sheet.grid->node(i, j));
      if (!top && boundary) setup.fixed_nodes.push_back(sheet.grid->node(i, j));
    }
  }
  const ClothSystem system = makeSystem("stvk", sheet, {500.0, 300.0, g, 0.0, 0.0, 0.0}, setup);
  ClothState state = system.restState();
  for (int n = 0; n < system.sheet().nodeCount(); ++n) state.q[3 * n] += gamma * state.q[3 * n + 1];
  // The clip is displaced by the shear of its own row.
  state.clips[1].translation().x() = gamma * 0.1;
  EquilibriumSolver solver(system);
  ASSERT_TRUE(solver.solve(state).converged());
  // F = [1 gamma; 0 1]: E_vv = gamma^2/2, 2E_uv = gamma. P = F S: P_uv = S_uv + gamma S_vv; the
  // side tractions of the two corner nodes cancel.
  const double expected = (g * gamma + gamma * 300.0 * gamma * gamma / 2.0) * 0.1;
  EXPECT_NEAR(-system.clipWrench(state, 1).force_N.x() / expected, 1.0, 1e-6);
  // The affine state is exact: the total energy has the closed form.
  const double density = 0.5 * g * gamma * gamma + 0.5 * 300.0 * std::pow(gamma * gamma / 2.0, 2);
  const double held =
      1.0 / 128.0;  // one corner triangle of 128 has all its nodes fixed and carries nothing
  EXPECT_NEAR(system.energy(state) / (density * 0.01 * (1.0 - held)), 1.0, 1e-6);
}

TEST(Equilibrium, CatenaryOfAHeavySoftSheetHangsInStableEquilibrium) {
  // A narrow, bending-free, nearly inextensible sheet between two supports: sag of the catenary of
  // the same length.
  const double length = 0.22, span = 0.2, width = 0.01;
  SheetMesh sheet = gridSheet({length, width}, 89, 3, DiagonalPattern::kUniform);
  SystemSetup setup = clampedEnds(sheet);
  setup.gravity_m_per_s2 = kDefaultGravity;
  const ClothSystem system = makeSystem("stvk", sheet, {2e4, 2e4, 1e3, 1e-10, 1e-10, 1e-10}, setup);
  ClothState state = system.restState();
  const Vec3 left(0.0, 0.0, 0.0), right(span, 0.0, 0.0);
  for (int n = 0; n < system.sheet().nodeCount(); ++n) {
    const double s = system.sheet().rest.positions(0, n) / length;
    state.q[3 * n] = span * s;
    state.q[3 * n + 2] = -0.15 * s * (1.0 - s);
  }
  system.setClipPose(state, 0, Eigen::Isometry3d::Identity());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation().x() = span - length;
  system.setClipPose(state, 1, pose);
  EquilibriumSolver solver(system);
  EquilibriumOptions options;
  options.max_iterations = 500;
  const EquilibriumSummary summary = solver.solve(state, options);
  ASSERT_TRUE(summary.converged())
      << describe(summary.termination) << " residual " << summary.residual_N;
  EXPECT_TRUE(summary.stable);
  double a = 0.1;  // 2 a sinh(span / 2a) = length
  for (int k = 0; k < 100; ++k) {
    const double f = 2 * a * std::sinh(span / (2 * a)) - length;
    const double df = 2 * std::sinh(span / (2 * a)) - span / a * std::cosh(span / (2 * a));
    a -= f / df;
  }
  const double sag = a * (std::cosh(span / (2 * a)) - 1.0);
  double lowest = 0.0;
  for (int n = 0; n < system.sheet().nodeCount(); ++n)
    lowest = std::min(lowest, state.q[3 * n + 2]);
  EXPECT_NEAR(-lowest / sag, 1.0, 0.005);
}

TEST(Equilibrium, LeavesTheSaddleOfACompressedStrip) {
  // Pushed together by 5 %, the flat strip is an equilibrium but not a stable one.
  SheetMesh sheet = gridSheet({0.1, 0.03}, 26, 5, DiagonalPattern::kUniform);
  const SystemSetup setup = clampedEnds(sheet);
  const ClothSystem system = makeSystem("stvk", sheet, {1e3, 1e3, 300.0, 1e-5, 1e-5, 5e-6}, setup);
  ClothState state = system.restState();
  for (int n = 0; n < system.sheet().nodeCount(); ++n) state.q[3 * n] *= 0.95;
  system.setClipPose(state, 0, Eigen::Isometry3d::Identity());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation().x() = -0.005;
  system.setClipPose(state, 1, pose);
  EquilibriumSolver solver(system);

  ClothState flat = state;
  EquilibriumOptions stay;
  stay.leave_saddles = false;
  stay.compute_lambda_min = true;
  const EquilibriumSummary saddle = solver.solve(flat, stay);
  ASSERT_TRUE(saddle.converged());
  EXPECT_FALSE(saddle.stable);
  EXPECT_LT(saddle.lambda_min_per_s2, 0.0);

  EquilibriumOptions leave;
  leave.compute_lambda_min = true;
  const EquilibriumSummary buckled = solver.solve(state, leave);
  ASSERT_TRUE(buckled.converged()) << describe(buckled.termination);
  EXPECT_TRUE(buckled.stable);
  EXPECT_GT(buckled.lambda_min_per_s2, 100.0 * buckled.lambda_min_residual_per_s2);
  EXPECT_LT(buckled.energy_J, 0.5 * saddle.energy_J);
}

/// A square sheet of the paper's model, 1 m wide, that hangs from some of its nodes.
ClothSystem hangingSquare(int nodes, std::vector<int> pins) {
  SheetMesh sheet = gridSheet({1.0, 1.0}, nodes, nodes, DiagonalPattern::kUniform);
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = 0.1;
  setup.fixed_nodes = std::move(pins);
  return makeSystem("edge-hinge", std::move(sheet), {3.0, 5e-3}, std::move(setup));
}

TEST(Equilibrium, PinnedCornersMayMoveByManyEdges) {
  constexpr int kNodes = 30;
  const ClothSystem system = hangingSquare(kNodes, {0, kNodes - 1});
  for (const double edges : {1.0, 3.0, 6.0, 10.0}) {
    ClothState state = system.restState();
    const double moved = edges / (kNodes - 1);
    state.q[0] += moved;
    state.q[3 * (kNodes - 1)] -= moved;
    EquilibriumSolver solver(system);
    EquilibriumOptions options;
    options.force_tolerance_N = 1e-9;
    options.compute_lambda_min = true;
    const EquilibriumSummary summary = solver.solve(state, options);
    ASSERT_TRUE(summary.converged()) << edges << ": " << describe(summary.termination);
    EXPECT_LE(summary.residual_N, 1e-9) << edges;
    EXPECT_TRUE(summary.stable) << edges;
    EXPECT_GT(summary.lambda_min_per_s2, 100.0 * summary.lambda_min_residual_per_s2) << edges;
  }
}

TEST(Equilibrium, OnePinLeavesASwivelThatMayBeHeld) {
  constexpr int kNodes = 15;
  const ClothSystem system = hangingSquare(kNodes, {0});
  ClothState state = system.restState();
  EXPECT_GE(system.swivelDof(state), 0);
  EXPECT_EQ(hangingSquare(kNodes, {0, kNodes - 1}).swivelDof(state), -1);
  EquilibriumSolver solver(system);
  EquilibriumOptions options;
  options.hold_swivel = true;
  options.compute_lambda_min = true;
  const EquilibriumSummary held = solver.solve(state, options);
  ASSERT_TRUE(held.converged()) << describe(held.termination);
  EXPECT_TRUE(held.stable);
  EXPECT_GT(held.lambda_min_per_s2, 1.0);
  options.hold_swivel = false;
  options.leave_saddles = false;
  const EquilibriumSummary free = solver.solve(state, options);
  ASSERT_TRUE(free.converged());
  EXPECT_LT(std::abs(free.lambda_min_per_s2), 1e-3);
}

TEST(Equilibrium, FreeClipHangsInItsCords) {
  SheetMesh sheet = gridSheet({0.1, 0.1}, 11, 11, DiagonalPattern::kUniform);
  SystemSetup setup = clampedEnds(sheet);
  setup.gravity_m_per_s2 = kDefaultGravity;
  setup.clips[1].free = true;
  setup.clips[1].mass_kg = 0.01;
  setup.clips[1].centre_of_mass_m = {0.1, 0.05, 0.0};
  for (double v : {0.02, 0.08})
    setup.clips[1].cords.push_back({{0.1, v, 0.0}, {0.3, v, 0.0}, 0.198, 2000.0});
  ClothSystem system = makeSystem("stvk", sheet, {500.0, 500.0, 100.0, 1e-5, 1e-5, 5e-6}, setup);
  ClothState state = system.restState();
  EquilibriumSolver solver(system);
  const EquilibriumSummary summary = solver.solve(state);
  ASSERT_TRUE(summary.converged()) << describe(summary.termination);
  EXPECT_TRUE(summary.stable);
  Vec3 cords = Vec3::Zero();
  for (int c : {0, 1})
    cords += system.cordTension_N(state, 1, c) * system.cordDirection(state, 1, c);
  const Vec3 cloth = system.clipWrench(state, 1).force_N;
  EXPECT_GT(cords.norm(), 1.0);
  EXPECT_LE((cords + cloth).norm(), 1e-6);
}

TEST(Equilibrium, SaysWhyItStopped) {
  SheetMesh sheet = gridSheet({0.1, 0.1}, 11, 11, DiagonalPattern::kUniform);
  SystemSetup setup = clampedEnds(sheet);
  setup.gravity_m_per_s2 = kDefaultGravity;
  const ClothSystem system =
      makeSystem("stvk", sheet, {500.0, 500.0, 100.0, 1e-5, 1e-5, 5e-6}, setup);
  ClothState state = system.restState();
  EquilibriumSolver solver(system);
  EquilibriumOptions options;
  options.max_iterations = 1;
  EXPECT_EQ(solver.solve(state, options).termination, Termination::kIterationLimit);
  options.max_iterations = 100;
  options.cancelled = [] { return true; };
  state = system.restState();
  EXPECT_EQ(solver.solve(state, options).termination, Termination::kCancelled);
  state.q[100] = std::nan("");
  options.cancelled = nullptr;
  EXPECT_EQ(solver.solve(state, options).termination, Termination::kNotFinite);
}

}  // namespace
}  // namespace tenter
