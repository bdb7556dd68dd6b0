// SPDX-License-Identifier: GPL-3.0-or-later
#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdio>

#include "interrupt.h"
#include "material_options.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/core/mesh_io.h"
#include "tenter/inversion/inversion_files.h"
#include "tenter/inversion/problem_file.h"
#include "verbs.h"
#include "vertex_selection.h"

namespace tenter::app {

namespace {

struct Options {
  std::string target, output, gravity = "0,0,-9.80665";
  MaterialOptions material;
  std::vector<std::string> obstacles, fix;
  double friction = 0.4, contact_distance_mm = 0.0, time_budget_s = 0.0;
};

void declare(CLI::App& command, Options& o) {
  command
      .add_option("target", o.target, "Shape in which the shell is to hang: OBJ, PLY or VTP [m]")
      ->required();
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
  command.add_option("--gravity", o.gravity, "x,y,z [m/s^2]")->capture_default_str();
  command.add_option("--time-budget", o.time_budget_s, "Most seconds; 0: no limit")
      ->check(CLI::NonNegativeNumber);
  command.add_option("-o,--output", o.output, "Folder to write")->required();
}

Result<ShellMaterial> shellMaterialOf(const Options& o) {
  const auto gravity = parseNumbers(o.gravity, 3, "--gravity");
  if (!gravity) return gravity.error();
  const auto material = simulatedMaterialOf(o.material);
  if (!material) return material.error();
  return ShellMaterial{material->model, material->laws, material->material.areal_density_kg_per_m2,
                       Vec3((*gravity)[0], (*gravity)[1], (*gravity)[2])};
}

Result<InversionProblem> problemOf(const Options& o) {
  InversionProblem problem;
  auto material = shellMaterialOf(o);
  if (!material) return material.error();
  problem.material = std::move(material).value();
  auto file = readMesh(o.target);
  if (!file) return file.error();
  problem.target = std::move(file->mesh);
  if (auto valid = validateMesh(problem.target); !valid) return valid.error().in(o.target);
  auto fixed = selectVertices(o.fix, problem.target);
  if (!fixed) return fixed.error();
  problem.fixed = std::move(fixed).value();
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
          {"material", o.material.file.empty() ? nlohmann::json{{"rho", o.material.rho},
                                                                {"k_stretch", o.material.k_stretch},
                                                                {"k_bend", o.material.k_bend}}
                                               : nlohmann::json(o.material.file)},
          {"obstacles", o.obstacles},
          {"friction", o.friction},
          {"contact_distance_mm", o.contact_distance_mm},
          {"time_budget_s", o.time_budget_s}};
}

void tell(const Options& o, const InversionProblem& problem, const InversionResult& r,
          Console& console) {
  const auto certificate = certificateToJson(problem, r, nullptr);
  console.answer = {{"contacts", problem.contacts.size()}, {"folder", o.output}};
  for (const char* key :
       {"status", "reason", "force_residual_rel", "cone_violations", "cone_margin_min",
        "lambda_min_per_s2", "negative_eigenvalues", "redrape_max_rel", "seconds", "factorizations",
        "stretch_max", "bend_max_rad", "load_balanced", "proof"}) {
    console.answer[key] = certificate.at(key);
  }
  const Certificate& c = r.certificate;
  char text[300];
  std::snprintf(
      text, sizeof text,
      "%s: %s; force residual %.2g of the weight, %zu contacts, %d outside their cones, "
      "smallest eigenvalue %.4g 1/s^2, rest edges up to %.0f %% longer or shorter, %.2g s",
      o.output.c_str(), name(r.status).c_str(), c.force_residual_rel, problem.contacts.size(),
      c.cone_violations, c.lambda_min_per_s2, 100.0 * c.stretch.cwiseAbs().maxCoeff(), r.seconds);
  console.say(text);
}

Result<int> run(const Options& o, Console& console) {
  if (auto free = checkOutputFolder(o.output, inversionFolder()); !free) return free.error();
  const auto problem = problemOf(o);
  if (!problem) return problem.error();
  const auto asked = askedOf(o, *problem);
  if (!asked) return asked.error();
  InversionOptions options;
  options.time_budget_s = o.time_budget_s;
  options.cancelled = interrupted;
  Result<InversionResult> result = badInput("", "", "");
  {
    Progress progress(console);
    options.progress = [&progress](const std::string& stage) {
      spdlog::info("{}", stage);
      progress.show(-1.0, stage);
    };
    result = invert(*problem, options);
  }
  if (!result) return result.error().file.empty() ? result.error().in(o.target) : result.error();
  if (auto done = writeInversion(o.output, *problem, *result, provenanceOf(o), *asked); !done)
    return done.error();
  tell(o, *problem, *result, console);
  if (result->status == InversionStatus::kCertified) return kDone;
  console.warn(name(result->status) + ": " + result->reason + "; the best so far is in " +
               o.output);
  return static_cast<int>(ErrorKind::kNotConverged);
}

}  // namespace

Verb invertVerb() {
  return {"invert", "Find the rest shape that hangs in a given one",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
