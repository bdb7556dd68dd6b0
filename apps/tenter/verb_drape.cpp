// SPDX-License-Identifier: GPL-3.0-or-later
#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>

#include "interrupt.h"
#include "material_options.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/core/mesh_io.h"
#include "tenter/mechanics/equilibrium.h"
#include "verbs.h"
#include "vertex_selection.h"

namespace tenter::app {

namespace {

constexpr std::string_view kOutputMarker = "\"displacement_m\"";
/// A mesh drawn in millimetres exceeds this, a garment or a curtain does not.
constexpr double kLargeSheet_m = 20.0;
/// Unless the user says otherwise, the smaller of a force and a share of the lightest node's
/// weight.
constexpr double kTolerance_N = 1e-9, kToleranceOfNodeWeight = 1e-4;

struct Options {
  std::string mesh, output, gravity = "0,0,-9.80665";
  MaterialOptions material;
  std::vector<std::string> fix, move;
  double tolerance_N = 0.0, time_budget_s = 0.0;
  int max_iterations = 500;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("mesh", o.mesh, "Sheet at rest: OBJ, PLY or VTP [m]")->required();
  declareMaterial(command, o.material);
  command
      .add_option("--fix", o.fix,
                  "Vertices that stay: 0,99 (from 0), 4-17, box:x0,y0,z0,x1,y1,z1 [m]")
      ->allow_extra_args(false);
  command
      .add_option("--move", o.move,
                  "A vertex of --fix and how far it is moved from rest: 0:0.05,0,0 [m]; again for "
                  "more")
      ->allow_extra_args(false);
  command.add_option("--gravity", o.gravity, "x,y,z [m/s^2]")->capture_default_str();
  command.add_option(
      "--tolerance-N", o.tolerance_N,
      "Largest force left on a degree of freedom; 0: 1e-4 of the lightest node's weight, "
      "at most 1e-9");
  command.add_option("--max-iterations", o.max_iterations, "Most Newton steps")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command.add_option("--time-budget", o.time_budget_s, "Most seconds; 0: no limit")
      ->check(CLI::NonNegativeNumber);
  command.add_option("-o,--output", o.output, "Draped sheet to write (VTP)")->required();
}

Result<ClothSystem> systemOf(const Options& o) {
  const auto gravity = parseNumbers(o.gravity, 3, "--gravity");
  if (!gravity) return gravity.error();
  const auto material = simulatedMaterialOf(o.material);
  if (!material) return material.error();
  const auto file = readMesh(o.mesh);
  if (!file) return file.error();
  if (auto valid = validateMesh(file->mesh); !valid) return valid.error().in(o.mesh);
  if (o.fix.empty()) {
    return usageError("a free sheet has no equilibrium under gravity: it falls",
                      "hold vertices with --fix, for example --fix 0,1");
  }
  SystemSetup setup;
  auto fixed = selectVertices(o.fix, file->mesh);
  if (!fixed) return fixed.error();
  setup.fixed_nodes = std::move(fixed).value();
  setup.areal_density_kg_per_m2 = material->material.areal_density_kg_per_m2;
  setup.gravity_m_per_s2 = Vec3((*gravity)[0], (*gravity)[1], (*gravity)[2]);
  const bool isotropic = material->model->membrane == MembraneElement::kEdges;
  auto sheet = sheetFromMesh(file->mesh, isotropic);
  if (!sheet) return sheet.error().in(o.mesh);
  auto system = ClothSystem::create(std::move(sheet).value(), *material->model, material->laws,
                                    std::move(setup));
  if (!system) return system.error().file.empty() ? system.error().in(o.mesh) : system.error();
  return system;
}

Result<void> moveFixed(const std::vector<std::string>& moves, const ClothSystem& system,
                       ClothState& state) {
  const std::vector<int>& fixed = system.setup().fixed_nodes;
  for (const std::string& move : moves) {
    const std::size_t colon = move.find(':');
    int id = -1;
    const char* const id_end = move.data() + std::min(colon, move.size());
    const auto [end, code] = std::from_chars(move.data(), id_end, id);
    if (colon == std::string::npos || code != std::errc() || end != id_end)
      return usageError("--move: cannot read '" + move + "'", "use a vertex and x,y,z: 0:0.05,0,0");
    if (std::find(fixed.begin(), fixed.end(), id) == fixed.end())
      return usageError("--move: vertex " + std::to_string(id) + " is not one of --fix");
    const auto by = parseNumbers(move.substr(colon + 1), 3, "--move");
    if (!by) return by.error();
    state.q.segment<3>(3 * id) += Vec3((*by)[0], (*by)[1], (*by)[2]);
  }
  return {};
}

Result<void> writeDraped(const std::string& file, const ClothSystem& system,
                         const ClothState& state) {
  const SheetMesh& sheet = system.sheet();
  TriangleMesh draped = sheet.rest;
  draped.positions = state.positions(sheet.nodeCount());
  MeshData data;
  data.point["displacement_m"] = draped.positions - sheet.rest.positions;
  Eigen::MatrixXd fixed = Eigen::MatrixXd::Zero(1, sheet.nodeCount());
  for (const int node : system.setup().fixed_nodes) fixed(0, node) = 1.0;
  data.point["fixed"] = fixed;
  data.cell["green_strain"] = greenStrains(sheet, draped.positions);
  return writeVtp(file, draped, data);
}

EquilibriumOptions solverOptions(const Options& o, const ClothSystem& system, Progress& progress) {
  EquilibriumOptions options;
  options.max_iterations = o.max_iterations;
  options.force_tolerance_N =
      o.tolerance_N > 0.0
          ? o.tolerance_N
          : std::min(kTolerance_N, kToleranceOfNodeWeight * system.lightestFreeNodeWeight_N());
  options.compute_lambda_min = true;
  options.hold_swivel = true;
  options.time_budget_s = o.time_budget_s;
  options.cancelled = interrupted;
  options.progress = [&progress](int iteration, double residual_N) {
    char text[96];
    std::snprintf(text, sizeof text, "iteration %d, residual %.3g N", iteration, residual_N);
    spdlog::info("{}", text);
    progress.show(-1.0, text);
  };
  return options;
}

void tell(const Options& o, const EquilibriumSummary& s, bool converged, bool swivels,
          Console& console) {
  console.answer = {{"converged", converged},
                    {"stable", s.stable},
                    {"swivels", swivels},
                    {"termination", describe(s.termination)},
                    {"iterations", s.newton_steps},
                    {"factorizations", s.factorizations},
                    {"residual_N", s.residual_N},
                    {"lambda_min_per_s2", s.lambda_min_per_s2},
                    {"lambda_min_residual_per_s2", s.lambda_min_residual_per_s2},
                    {"seconds", s.seconds},
                    {"energy_J", s.energy_J},
                    {"file", o.output}};
  char text[200];
  std::snprintf(text, sizeof text,
                "%s: residual %.3g N after %d Newton steps, smallest eigenvalue %.4g 1/s^2, %.2g s",
                o.output.c_str(), s.residual_N, s.newton_steps, s.lambda_min_per_s2, s.seconds);
  console.say(text);
  if (swivels && converged)
    console.say("nothing stops it from turning about its pin; it is stable but for that");
}

void warnIfLarge(const Options& o, const ClothSystem& system, const Console& console) {
  const Points3& x = system.sheet().rest.positions;
  const double size_m = (x.rowwise().maxCoeff() - x.rowwise().minCoeff()).maxCoeff();
  if (size_m <= kLargeSheet_m) return;
  char text[96];
  std::snprintf(text, sizeof text, ": the sheet is %.4g m wide; coordinates must be in metres",
                size_m);
  console.warn(o.mesh + text);
}

Result<int> run(const Options& o, Console& console) {
  if (auto free = checkOutputFile(o.output, kOutputMarker); !free) return free.error();
  if (!std::isfinite(o.tolerance_N) || o.tolerance_N < 0.0) {
    return usageError("--tolerance-N must not be negative");
  }
  auto system = systemOf(o);
  if (!system) return system.error();
  warnIfLarge(o, *system, console);
  ClothState state = system->restState();
  if (auto moved = moveFixed(o.move, *system, state); !moved) return moved.error();
  const bool swivels = system->swivelDof(state) >= 0;
  EquilibriumSolver solver(*system);
  EquilibriumSummary summary;
  {
    Progress progress(console);
    summary = solver.solve(state, solverOptions(o, *system, progress));
  }
  if (auto done = writeDraped(o.output, *system, state); !done) return done.error();
  const bool converged = summary.converged() && summary.stable;
  tell(o, summary, converged, swivels, console);
  if (converged) return kDone;
  console.warn("not an equilibrium (" + describe(summary.termination) +
               "); the best so far is in " + o.output);
  return static_cast<int>(ErrorKind::kNotConverged);
}

}  // namespace

Verb drapeVerb() {
  return {"drape", "Find the shape in which a sheet hangs",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
