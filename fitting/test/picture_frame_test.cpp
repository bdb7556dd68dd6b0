// SPDX-License-Identifier: GPL-3.0-or-later
// The picture frame in the mechanics of a fit, against its closed form (docs/mechanics.md).
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "cloth_fixture.h"

namespace tenter::kinds {
namespace {

constexpr double kShear_N_per_m = 50.0;
/// Shear angles at which the frame is read.
constexpr std::array kAngles_rad = {0.02, 0.1, 0.2, 0.35};

constexpr int kNodes = 25;
/// In the ideal frame top and bottom hold both of their corners, whose forces cancel along them;
/// the other two bars miss half a mesh width of their side at each end.
constexpr double kHeldShare = 1.0 - 0.5 / (kNodes - 1);
/// There the state is affine: what is left is rounding.
constexpr double kAffine = 1e-9;

struct FrameShape {
  double depth_m, gap_m;  ///< Of cloth under a bar; of a corner that the bars leave free.
  double side_m() const { return kSide_m - 2.0 * depth_m; }  ///< Between the bars' inner lines.
};
/// Bars that are lines and meet in the corners, the ideal; and those of the shear protocol.
constexpr FrameShape kIdeal{0.0, 0.0}, kProtocol{0.005, 0.01};

struct Bar {
  Vec2 low, high, inner;  ///< Box on the cloth; middle of the side that faces the cloth.
  Vec2 along() const { return high.x() - low.x() > high.y() - low.y() ? Vec2(1, 0) : Vec2(0, 1); }
};

/// Top and bottom first: they hold the corners of the ideal frame.
std::array<Bar, 4> barsOf(const FrameShape& shape) {
  const double s = kSide_m, d = shape.depth_m, g = shape.gap_m, half = 0.5 * s;
  return {Bar{{g, s - d}, {s - g, s}, {half, s - d}}, Bar{{g, 0.0}, {s - g, d}, {half, d}},
          Bar{{s - d, g}, {s, s - g}, {s - d, half}}, Bar{{0.0, g}, {d, s - g}, {d, half}}};
}

StiffnessCurve constantShear() { return StiffnessCurve::constant(kShear_N_per_m, true); }

/// Stiffens threefold over the angles of the test.
StiffnessCurve hermiteShear() {
  return StiffnessCurve::fromKnots({0.0, 0.15, 0.3},
                                   {kShear_N_per_m, 1.5 * kShear_N_per_m, 3.0 * kShear_N_per_m},
                                   {0.0, 300.0, 600.0}, true)
      .value();
}

ParameterSet clothOf(std::string_view model, double stretch_N_per_m, const StiffnessCurve& shear) {
  ParameterSet set;
  set.model = &modelNamed(model);
  for (int i = 0; i < set.model->componentCount(); ++i) {
    const ComponentInfo& info = set.model->component(i);
    const double value = info.name.starts_with("stretch") ? stretch_N_per_m : 0.0;
    set.components.push_back(
        {info.name == "shear" ? shear : StiffnessCurve::constant(value, info.even), nullptr});
  }
  return set;
}

ClothSystem frameSystem(const ParameterSet& cloth, const FrameShape& shape, int nodes) {
  const SheetFrame sheet =
      sheetFrame(gridSheet(Vec2::Constant(kSide_m), 2, 2, DiagonalPattern::kUniform).rest).value();
  std::vector<ClipOutline> outlines;
  for (const Bar& bar : barsOf(shape))
    outlines.push_back(
        {bar.low, {bar.high.x(), bar.low.y()}, bar.high, {bar.low.x(), bar.high.y()}});
  FitTestOptions options;
  options.nodes = nodes;
  const GridLines lines = replicaLines(sheet, outlines, options);
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = 0.15;
  setup.gravity_m_per_s2.setZero();
  setup.planar = true;
  for (std::vector<int>& held : heldNodes(lines, outlines)) {
    setup.clips.emplace_back();
    setup.clips.back().nodes = std::move(held);
  }
  return ClothSystem::create(gridSheet(lines), *cloth.model,
                             makeLaws(*cloth.model, cloth.components), setup)
      .value();
}

/// Mean over the four bars of the force along them, as a fit predicts it, at a shear angle.
double forceAlongBars(const ClothSystem& system, const FrameShape& shape, double angle_rad) {
  const double half = 0.5 * angle_rad;
  Mat2 map;
  map << std::cos(half), std::sin(half), std::sin(half), std::cos(half);
  const Vec2 middle = Vec2::Constant(0.5 * kSide_m);
  ClothState state = system.restState();
  for (int n = 0; n < system.sheet().nodeCount(); ++n) {
    const Vec2 from_middle = state.q.segment<2>(3 * n) - middle;
    state.q.segment<2>(3 * n) = middle + map * from_middle;
  }
  const std::array<Bar, 4> bars = barsOf(shape);
  for (std::size_t c = 0; c < bars.size(); ++c) {
    const double turn = bars[c].along().x() > 0.0 ? half : -half;
    const Vec2 inner = bars[c].inner;
    system.setClipPose(state, static_cast<int>(c),
                       turned(turn, inner, middle + map * (inner - middle) - inner));
  }
  EquilibriumSolver solver(system);
  const EquilibriumSummary solved = solver.solve(state);
  EXPECT_TRUE(solved.converged() && solved.stable) << describe(solved.termination);
  double sum = 0.0;
  for (std::size_t c = 0; c < bars.size(); ++c) {
    // Top and right are drawn towards the corner between them, the other two towards theirs.
    const double sign = c % 2 == 0 ? 1.0 : -1.0;
    const Vec3 force = -system.clipWrench(state, static_cast<int>(c)).force_N;
    sum += sign * force.head<2>().dot(map * bars[c].along()) / 4.0;
  }
  return sum;
}

/// Triangles: w_u and w_v keep their length, w_u . w_v = sin(angle).
double triangleForce(const StiffnessCurve& shear, double side_m, double angle_rad) {
  return shear.evaluate(std::sin(angle_rad)).stress * side_m;
}

/// Springs: one diagonal of a quad grows as much as the other shrinks, and both also pull across.
double springForce(const StiffnessCurve& shear, double side_m, double angle_rad) {
  const double e = std::sin(angle_rad);
  const double grown = std::sqrt(1.0 + e), shrunk = std::sqrt(1.0 - e);
  const double pull = shear.evaluate(grown - 1.0).stress / grown;
  const double push = shear.evaluate(shrunk - 1.0).stress / shrunk;
  return 0.25 * side_m * ((pull - push) + e * (pull + push));
}

TEST(PictureFrame, TrianglesCarryTheClosedForm) {
  for (const char* model : {"stvk", "soft"})
    for (const StiffnessCurve& shear : {constantShear(), hermiteShear()}) {
      const ClothSystem system = frameSystem(clothOf(model, 800.0, shear), kIdeal, kNodes);
      for (const double angle : kAngles_rad) {
        const double expected = kHeldShare * triangleForce(shear, kSide_m, angle);
        EXPECT_NEAR(forceAlongBars(system, kIdeal, angle) / expected, 1.0, kAffine)
            << model << " at " << angle;
      }
    }
}

TEST(PictureFrame, SpringsCarryTheClosedForm) {
  for (const StiffnessCurve& shear : {constantShear(), hermiteShear()}) {
    const ClothSystem system = frameSystem(clothOf("springs", 800.0, shear), kIdeal, kNodes);
    for (const double angle : kAngles_rad) {
      const double expected = kHeldShare * springForce(shear, kSide_m, angle);
      EXPECT_NEAR(forceAlongBars(system, kIdeal, angle) / expected, 1.0, kAffine) << "at " << angle;
    }
  }
}

// Where yarns stretch far less than they shear, the cloth between the inner lines of the bars must
// follow the frame although its corners are free.
TEST(PictureFrame, TheProtocolsBarsCarryTheClosedFormWithinHalfAPercent) {
  constexpr double kStretch_N_per_m = 2e4;
  constexpr double kTolerance = 0.005;
  for (const char* model : {"stvk", "soft"})
    for (const StiffnessCurve& shear : {constantShear(), hermiteShear()}) {
      const ClothSystem system =
          frameSystem(clothOf(model, kStretch_N_per_m, shear), kProtocol, kNodes);
      for (const double angle : kAngles_rad) {
        const double expected = triangleForce(shear, kProtocol.side_m(), angle);
        EXPECT_NEAR(forceAlongBars(system, kProtocol, angle) / expected, 1.0, kTolerance)
            << model << " at " << angle;
      }
    }
}

}  // namespace
}  // namespace tenter::kinds
