// SPDX-License-Identifier: GPL-3.0-or-later
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

#include "interrupt.h"
#include "invert_target.h"
#include "material_options.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/inversion/inversion_files.h"
#include "tenter/inversion/material_directions.h"
#include "tenter/inversion/problem_file.h"
#include "verbs.h"
#include "vertex_selection.h"

namespace tenter::app {

namespace {

constexpr double kLeastBudget_s = 1e-3;
/// Of the time budget; writing files takes the rest.
constexpr double kSolving = 0.95;

struct Options {
  std::string target, output, warp, method = "direct", rest = "mesh", prefer = "none", gravity;
  MeasuredTargetOptions measured;
  MaterialOptions material;
  std::vector<std::string> obstacles, fix;
  double friction = 0.4, contact_distance_mm = 0.0, time_budget_s = 0.0;
  double prefer_share = 1.0, smooth_mm = 0.0;
  bool range = false;
};

void declare(CLI::App& command, Options& o) {
  command
      .add_option("target", o.target,
                  "Shape in which the shell is to hang: OBJ, PLY or VTP [m], or a measurement's "
                  "folder, whose clips then hold it")
      ->required();
  command.add_option("--frame", o.measured.frame, "Of a measurement, from 0; else its last")
      ->check(CLI::NonNegativeNumber);
  command
      .add_option("--nodes", o.measured.nodes,
                  "Of a measurement: vertices a side of the mesh that is laid through its vertices")
      ->check(CLI::Range(5, 400))
      ->capture_default_str();
  declareMaterial(command, o.material);
  command
      .add_option(
          "--obstacle", o.obstacles,
          "What it touches: a mesh file, sphere:x,y,z,r, plane:x,y,z,nx,ny,nz, "
          "cylinder:ax,ay,az,bx,by,bz,r or cone:ax,ay,az,bx,by,bz,ra,rb [m]; may be repeated")
      ->allow_extra_args(false);
  command.add_option("--friction", o.friction, "Coulomb's coefficient at every contact")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  command
      .add_option("--contact-distance-mm", o.contact_distance_mm,
                  "Vertices this near an obstacle touch it; 0: 1e-3 of the target's size")
      ->check(CLI::NonNegativeNumber);
  command
      .add_option("--fix", o.fix,
                  "Vertices that are held: 0,99 (from 0), 4-17, box:x0,y0,z0,x1,y1,z1 [m]")
      ->allow_extra_args(false);
  command.add_option("--warp", o.warp,
                     "x,y,z: direction of the warp, laid into each triangle, instead of the "
                     "target's material coordinates");
  command.add_option("--gravity", o.gravity,
                     "x,y,z [m/s^2]; else a measurement's own, or 0,0,-9.80665");
  command.add_option("--time-budget", o.time_budget_s, "Most seconds; 0: no limit")
      ->check(CLI::NonNegativeNumber);
  command
      .add_option("--method", o.method,
                  "direct, or reference: the algorithm of [Inv18], for comparison on small targets")
      ->check(CLI::IsMember({"direct", "reference"}))
      ->capture_default_str();
  command
      .add_option("--rest", o.rest,
                  "mesh: a shape that can be cut and sewn; metric: a rest length and angle for "
                  "every edge, which need not fit together (--k-stretch and --k-bend only)")
      ->check(CLI::IsMember({"mesh", "metric"}))
      ->capture_default_str();
  command
      .add_option("--prefer", o.prefer,
                  "What the rest shape is to be like where contacts leave a choice: flat: without "
                  "bends; smooth: without the target's short folds; none: near the target")
      ->check(CLI::IsMember({"none", "flat", "smooth"}))
      ->capture_default_str();
  command
      .add_option("--prefer-share", o.prefer_share,
                  "Of that, 0 to 1; halved until a certified rest shape is found")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command
      .add_option("--smooth-mm", o.smooth_mm,
                  "Of smooth: folds shorter than 2 pi times this go; 0: 3 % of the target's size")
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--range", o.range,
                   "Find the multiples of stiffness and friction that have a certified rest shape");
  command.add_option("-o,--output", o.output, "Folder to write")->required();
}

Result<Vec3> gravityOf(const Options& o, const Vec3& otherwise) {
  if (o.gravity.empty()) return otherwise;
  const auto gravity = parseNumbers(o.gravity, 3, "--gravity");
  if (!gravity) return gravity.error();
  return Vec3((*gravity)[0], (*gravity)[1], (*gravity)[2]);
}

Result<ShellMaterial> shellMaterialOf(const Options& o, const Vec3& gravity_m_per_s2) {
  const auto gravity = gravityOf(o, gravity_m_per_s2);
  if (!gravity) return gravity.error();
  const auto material = simulatedMaterialOf(o.material);
  if (!material) return material.error();
  return ShellMaterial{material->model, material->laws, material->material.areal_density_kg_per_m2,
                       *gravity};
}

/// Material directions where the target has none, or others are asked for.
Result<std::vector<MaterialFrame>> framesOf(const Options& o, const InversionProblem& problem,
                                            const Console& console) {
  const bool needed = problem.material.model->membrane != MembraneElement::kEdges;
  if (!needed || (o.warp.empty() && problem.target.hasUv())) return std::vector<MaterialFrame>{};
  if (o.warp.empty()) {
    console.warn(o.target +
                 ": no material coordinates without a seam; the warp is laid along y, or along z "
                 "where the cloth faces y (--warp x,y,z says otherwise)");
    return framesAlong(problem.target, {Vec3::UnitY(), Vec3::UnitZ()});
  }
  const auto warp = parseNumbers(o.warp, 3, "--warp");
  if (!warp) return warp.error();
  const Vec3 direction((*warp)[0], (*warp)[1], (*warp)[2]);
  if (!(direction.norm() > 0.0)) return usageError("--warp has no direction");
  return framesAlong(problem.target, {direction});
}

Result<InversionProblem> problemOf(const Options& o, const Console& console) {
  InversionProblem problem;
  auto target = readTarget(o.target, o.measured, console);
  if (!target) return target.error();
  problem.target = std::move(target->mesh);
  auto material = shellMaterialOf(o, target->gravity_m_per_s2);
  if (!material) return material.error();
  problem.material = std::move(material).value();
  if (auto valid = validateMesh(problem.target); !valid) return valid.error().in(o.target);
  auto frames = framesOf(o, problem, console);
  if (!frames) return frames.error().in(o.target);
  problem.frames = std::move(frames).value();
  auto fixed = selectVertices(o.fix, problem.target);
  if (!fixed) return fixed.error();
  std::set_union(fixed->begin(), fixed->end(), target->held.begin(), target->held.end(),
                 std::back_inserter(problem.fixed));
  std::vector<std::unique_ptr<Obstacle>> obstacles;
  for (const std::string& description : o.obstacles) {
    auto obstacle = makeObstacle(description);
    if (!obstacle) return obstacle.error();
    obstacles.push_back(std::move(obstacle).value());
  }
  auto contacts = findContacts(problem.target, obstacles, problem.fixed,
                               {o.friction, 1e-3 * o.contact_distance_mm});
  if (!contacts) return contacts.error().in(o.target);
  problem.contacts = std::move(contacts).value();
  return problem;
}

Result<nlohmann::json> askedOf(const Options& o, const InversionProblem& problem) {
  auto material = materialOf(o.material);
  if (!material) return material.error();
  return problemToJson({std::move(material).value(), problem.material.gravity_m_per_s2, o.friction,
                        problem.fixed, o.obstacles});
}

nlohmann::json provenanceOf(const Options& o) {
  return {{"program", std::string("tenter ") + TENTER_VERSION},
          {"target", o.target},
          {"frame", o.measured.frame ? nlohmann::json(*o.measured.frame) : nlohmann::json()},
          {"nodes", o.measured.nodes},
          {"material", o.material.file.empty() ? nlohmann::json{{"rho", o.material.rho},
                                                                {"k_stretch", o.material.k_stretch},
                                                                {"k_bend", o.material.k_bend}}
                                               : nlohmann::json(o.material.file)},
          {"obstacles", o.obstacles},
          {"friction", o.friction},
          {"contact_distance_mm", o.contact_distance_mm},
          {"warp", o.warp},
          {"method", o.method},
          {"rest", o.rest},
          {"prefer", o.prefer},
          {"prefer_share", o.prefer_share},
          {"smooth_mm", o.smooth_mm},
          {"time_budget_s", o.time_budget_s}};
}

void tell(const Options& o, const InversionProblem& problem, const InversionResult& r,
          const FeasibleRange* range, Console& console) {
  const auto certificate = certificateToJson(problem, r, nullptr, range);
  console.answer = {{"contacts", problem.contacts.size()}, {"folder", o.output}};
  for (const char* key : {"status",
                          "reason",
                          "force_residual_rel",
                          "force_rounding_rel",
                          "cone_violations",
                          "cone_margin_min",
                          "lambda_min_per_s2",
                          "negative_eigenvalues",
                          "redrape_max_rel",
                          "seconds",
                          "solve_cpu_seconds",
                          "forces_cpu_seconds",
                          "factorizations",
                          "stretch_max",
                          "bend_max_rad",
                          "load_balanced",
                          "preference",
                          "target_shape",
                          "rest_shape",
                          "proof",
                          "range"}) {
    if (certificate.contains(key)) console.answer[key] = certificate.at(key);
  }
  const Certificate& c = r.certificate;
  char text[400], eigenvalue[60] = "stability not looked at";
  if (c.measured_stability && std::isfinite(c.lambda_min_per_s2))
    std::snprintf(eigenvalue, sizeof eigenvalue, "smallest eigenvalue %.4g 1/s^2",
                  c.lambda_min_per_s2);
  else if (c.measured_stability)
    std::snprintf(eigenvalue, sizeof eigenvalue, "nothing free to move");
  std::snprintf(text, sizeof text,
                "%s: %s; force residual %.2g of the weight, %zu contacts, %d outside their cones, "
                "%s, rest edges up to %.2g %% longer or shorter, %.2g s",
                o.output.c_str(), name(r.status).c_str(), c.force_residual_rel,
                problem.contacts.size(), c.cone_violations, eigenvalue,
                100.0 * c.stretch.cwiseAbs().maxCoeff(), r.seconds);
  console.say(text);
}

/// A factor for people.
std::string shown(const std::optional<double>& factor) {
  if (!factor) return "none";
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", *factor);
  return text;
}

Result<int> finish(const Options& o, const InversionProblem& problem, const InversionResult& result,
                   const FeasibleRange* range, Console& console) {
  auto asked = askedOf(o, problem);
  if (!asked) return asked.error();
  // The files that were named do not hold a material that the search has scaled.
  if (range != nullptr && range->result_stiffness != 1.0) *asked = nullptr;
  if (auto done = writeInversion(o.output, problem, result, provenanceOf(o), *asked, range); !done)
    return done.error();
  tell(o, problem, result, range, console);
  if (range != nullptr) {
    console.say("certified from " + shown(range->stiffness_min) + " to " +
                shown(range->stiffness_max) + " times the stiffness, and from " +
                shown(range->friction_min) + " times the friction on");
  }
  if (result.status == InversionStatus::kCertified) return kDone;
  console.warn(name(result.status) + ": " + result.reason + "; the best so far is in " + o.output);
  return static_cast<int>(ErrorKind::kNotConverged);
}

RestPreference preferenceOf(const Options& o) {
  RestPreference out{.share = o.prefer_share, .smoothing_length_m = 1e-3 * o.smooth_mm};
  if (o.prefer == "flat") out.kind = RestShapeKind::kFlat;
  if (o.prefer == "smooth") out.kind = RestShapeKind::kSmooth;
  return out;
}

Result<int> run(const Options& o, Console& console) {
  const auto start = std::chrono::steady_clock::now();
  if (auto free = checkOutputFolder(o.output, inversionFolder()); !free) return free.error();
  if (o.prefer != "none" && o.method == "reference")
    return usageError("--method reference has no preference for a rest shape",
                      "leave --prefer away");
  if (o.rest == "metric" && o.method == "reference")
    return usageError("--method reference finds rest meshes only", "leave --rest metric away");
  auto problem = problemOf(o, console);
  if (!problem) return problem.error();
  InversionOptions options;
  // Reading counts too, and writing is still to come.
  const std::chrono::duration<double> read = std::chrono::steady_clock::now() - start;
  if (o.time_budget_s > 0.0)
    options.time_budget_s = std::max(kSolving * o.time_budget_s - read.count(), kLeastBudget_s);
  options.cancelled = interrupted;
  if (o.method == "reference") options.method = InversionMethod::kReference;
  if (o.rest == "metric") options.rest = RestKind::kMetric;
  options.preference = preferenceOf(o);
  std::optional<Progress> progress(std::in_place, console);
  options.progress = [&progress](const std::string& stage) {
    spdlog::info("{}", stage);
    progress->show(-1.0, stage);
  };
  const auto placed = [&](const Error& e) {
    return e.file.empty() && e.kind != ErrorKind::kUsage ? e.in(o.target) : e;
  };
  if (!o.range) {
    const auto result = invert(*problem, options);
    progress.reset();
    if (!result) return placed(result.error());
    return finish(o, *problem, *result, nullptr, console);
  }
  const auto range = findFeasibleRange(*problem, options);
  progress.reset();
  if (!range) return placed(range.error());
  problem->material = scaled(problem->material, range->result_stiffness);
  return finish(o, *problem, range->result, &*range, console);
}

}  // namespace

Verb invertVerb() {
  return {"invert", "Find the rest shape that hangs in a given one",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
