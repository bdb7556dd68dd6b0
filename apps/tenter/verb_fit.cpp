// SPDX-License-Identifier: GPL-3.0-or-later
#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdio>
#include <limits>

#include "fit_options.h"
#include "interrupt.h"
#include "output_guard.h"
#include "progress.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  std::vector<std::string> measurements;
  std::string model = "stvk", variant = "orthotropic", output;
  SimulationOptions simulation;
  int max_knots = 5, max_iterations = 30;
  bool no_law_uncertainty = false;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("measurements", o.measurements, "Folders of measurements of one fabric")
      ->required();
  command.add_option("--model", o.model, "springs, soft, stvk or stvk-coupled")
      ->capture_default_str();
  command.add_option("--variant", o.variant, "linear, isotropic, linear-isotropic or orthotropic")
      ->capture_default_str();
  command.add_option("-o,--output", o.output, "Material file to write")->required();
  command.add_option("--max-knots", o.max_knots, "Most knots of a curve")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  command.add_option("--max-iterations", o.max_iterations, "Most outer iterations of a stage")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command.add_flag("--no-law-uncertainty", o.no_law_uncertainty,
                   "Do not fit a second law to see how much the choice of law matters");
  declareSimulation(command, o.simulation);
}

Result<FitOptions> fitOptions(const Options& o, Progress& progress) {
  const auto variant = parseVariant(o.variant);
  if (!variant) return variant.error();
  FitOptions options;
  options.model = o.model;
  options.variant = *variant;
  options.test = o.simulation.inSi();
  options.max_knots = o.max_knots;
  options.max_outer_iterations = o.max_iterations;
  options.threads = o.simulation.threads;
  options.law_uncertainty = !o.no_law_uncertainty;
  options.cancelled = interrupted;
  options.progress = [&progress](const FitOptions::Progress& at) {
    char text[160];
    std::snprintf(text, sizeof text, "%s, iteration %d, cost %.5g, residual %.3f %%",
                  at.stage.c_str(), at.iteration, at.cost, 100.0 * at.relative_rms);
    spdlog::info("{}", text);
    progress.show(-1.0, text);
  };
  return options;
}

/// Twice the same numbers would look twice as certain.
Result<void> checkDifferent(const std::vector<Measurement>& measurements) {
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (measurements[i].content_sha256 != measurements[j].content_sha256) continue;
      return badInput(measurements[i].name, "", "holds the same numbers as " + measurements[j].name,
                      "give each measurement once");
    }
  }
  return {};
}

nlohmann::json curveToJson(const MaterialComponent& component) {
  auto knots = nlohmann::json::array();
  const auto& strains = component.curve.strains();
  for (std::size_t i = 0; i < strains.size(); ++i) {
    nlohmann::json knot = {
        {"strain", strains[i]},
        {"stiffness", component.curve.stiffnesses()[i]},
        {"std", i < component.knot_std.size() ? component.knot_std[i]
                                              : std::numeric_limits<double>::quiet_NaN()}};
    if (i < component.knot_observed.size()) {
      knot["observed"] = static_cast<bool>(component.knot_observed[i]);
    }
    knots.push_back(std::move(knot));
  }
  return {{"component", component.name}, {"knots", knots}};
}

/// Components, or single knots of them, that no measurement sees.
nlohmann::json unobservedOf(const Material& material) {
  auto rows = nlohmann::json::array();
  for (const MaterialComponent& component : material.components) {
    if (component.status == ComponentStatus::kAssumed) continue;
    const bool all = component.status == ComponentStatus::kUnobserved;
    auto knots = nlohmann::json::array();
    for (std::size_t i = 0; i < component.curve.strains().size(); ++i) {
      const bool seen = i >= component.knot_observed.size() || component.knot_observed[i];
      if (all || !seen) knots.push_back(component.curve.strains()[i]);
    }
    if (!knots.empty()) rows.push_back({{"component", component.name}, {"strains", knots}});
  }
  return rows;
}

void tell(const Options& o, const FitResult& fit, Console& console) {
  auto& answer = console.answer;
  answer = {{"material", o.output},
            {"converged", fit.converged},
            {"cancelled", fit.cancelled},
            {"seconds", fit.seconds},
            {"factorizations", fit.factorizations},
            {"newton_steps", fit.newton_steps},
            {"outer_iterations", fit.outer_iterations},
            {"tests", nlohmann::json::array()},
            {"curves", nlohmann::json::array()},
            {"unobserved", unobservedOf(fit.material)},
            {"warnings", fit.warnings}};
  for (const TestResidual& test : fit.tests) {
    answer["tests"].push_back(residualToJson(test));
    console.say(residualLine(test));
  }
  for (const MaterialComponent& component : fit.material.components) {
    answer["curves"].push_back(curveToJson(component));
  }
  // What the fit says of itself: identifiability, scatter between specimens, the law's share.
  answer["fit"] = fit.material.fit;
  for (const std::string& warning : fit.warnings) console.warn(warning);
  console.say(o.output + ": " + std::to_string(fit.outer_iterations) + " outer iterations, " +
              std::to_string(fit.factorizations) + " factorizations");
}

Result<int> run(const Options& o, Console& console) {
  if (auto free = checkMaterialOutput(o.output); !free) return free.error();
  Progress progress(console);
  const auto options = fitOptions(o, progress);
  if (!options) return options.error();
  const auto measurements = readMeasurements(o.measurements);
  if (!measurements) return measurements.error();
  if (auto different = checkDifferent(*measurements); !different) return different.error();
  const auto fit = fitMaterial(*measurements, *options);
  if (!fit) return fit.error();
  if (auto done = writeMaterial(o.output, fit->material); !done) return done.error();
  tell(o, *fit, console);
  if (fit->converged) return kDone;
  console.warn(fit->cancelled ? "stopped; the best so far is in " + o.output
                              : "did not converge; the best so far is in " + o.output);
  return static_cast<int>(ErrorKind::kNotConverged);
}

}  // namespace

Verb fitVerb() {
  return {"fit", "Fit a material to measurements of one fabric",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
