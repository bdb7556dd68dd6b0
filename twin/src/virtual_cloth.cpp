// SPDX-License-Identifier: GPL-3.0-or-later
#include "virtual_cloth.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rig_setup.h"

namespace tenter {

Result<ClothSource> makeClothSource(const Fabric& specimen, const std::optional<OwnLaw>& own_law) {
  ClothSource out;
  const auto model = findClothModel(own_law ? own_law->model : "stvk");
  if (!model) return model.error();
  out.model = *model;
  if (!own_law) {
    out.membrane = std::make_shared<SpecimenMembraneLaw>(specimen.membrane);
    out.bending = std::make_shared<SpecimenBendingLaw>(specimen.bending);
    return out;
  }
  require(static_cast<int>(own_law->components.size()) == out.model->componentCount(),
          "CaptureOptions::own_law: one curve a component of the model");
  const ClothLaws laws = makeLaws(*out.model, own_law->components);
  out.membrane = laws.membrane;
  out.bending = laws.bending;
  out.own = true;
  return out;
}

namespace {

constexpr double kBias_rad = 0.25 * std::numbers::pi;

Vec2 turned(Vec2 place, double angle_rad) { return Eigen::Rotation2Dd(angle_rad) * place; }

}  // namespace

Vec2 materialPoint(Vec2 place, bool on_bias) { return on_bias ? turned(place, kBias_rad) : place; }

void turnMaterial(SheetMesh& sheet, double angle_rad) {
  for (int n = 0; n < sheet.nodeCount(); ++n) {
    sheet.rest.uv.col(n) = turned(sheet.rest.positions.col(n).head<2>(), angle_rad);
  }
  for (int t = 0; t < sheet.triangleCount(); ++t) {
    const Triangle& ids = sheet.rest.triangles[t];
    Mat2 edges;
    edges << sheet.rest.uv.col(ids[1]) - sheet.rest.uv.col(ids[0]),
        sheet.rest.uv.col(ids[2]) - sheet.rest.uv.col(ids[0]);
    sheet.triangles[t].edges_inverse = edges.inverse();
  }
  sheet.grid.reset();
  sheet.pattern += " turned";
}

SheetMesh sampleSheet(GridLines lines, bool on_bias) {
  SheetMesh sheet = gridSheet(std::move(lines));
  if (on_bias) turnMaterial(sheet, kBias_rad);
  return sheet;
}

TriangleMesh trackedMesh(int per_side, bool on_bias) {
  return sampleSheet({linesThrough(0.0, kSampleSide_m, per_side, {}),
                      linesThrough(0.0, kSampleSide_m, per_side, {}), DiagonalPattern::kUniform},
                     on_bias)
      .rest;
}

bool findStableShape(EquilibriumSolver& solver, ClothState& state, CaptureStatistics& statistics,
                     const std::function<bool()>& cancelled) {
  constexpr int kMaxNewtonSteps = 300;  // frames take 5 to 18 on the average, snaps many times that
  const ClothState before = state;
  EquilibriumOptions options;
  options.max_iterations = kMaxNewtonSteps;
  options.cancelled = cancelled;
  const EquilibriumSummary summary = solver.solve(state, options);
  statistics.newton_steps += summary.newton_steps;
  statistics.factorizations += summary.factorizations;
  const bool good = summary.converged() && summary.stable;
  if (good) {
    statistics.largest_residual_N = std::max(statistics.largest_residual_N, summary.residual_N);
  } else {
    state = before;
  }
  return good;
}

}  // namespace tenter
