// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

#include "fit_options.h"
#include "interrupt.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  std::string material;
  std::vector<std::string> measurements, truths;
  SimulationOptions simulation;
  bool predictions = false;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("material", o.material, "Material file")->required();
  command.add_option("measurements", o.measurements,
                     "Folders of measurements, none of them fitted");
  command
      .add_option("--truth", o.truths,
                  "Folder of a virtual capture's truth: compare with what it was without noise")
      ->allow_extra_args(false);
  command.add_flag("--predictions", o.predictions,
                   "With --json: every frame's prediction and band");
  declareSimulation(command, o.simulation);
}

double meanOf(const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double at(const std::vector<double>& values, std::size_t i) {
  return i < values.size() ? values[i] : std::numeric_limits<double>::quiet_NaN();
}

nlohmann::json framesToJson(const EvaluatedTest& test) {
  auto rows = nlohmann::json::array();
  for (std::size_t i = 0; i < test.frames.size(); ++i) {
    const FramePrediction& frame = test.frames[i];
    rows.push_back({{"time_s", frame.time_s},
                    {"displacement", frame.displacement},
                    {"measured", frame.summary_measured},
                    {"predicted", frame.summary_predicted},
                    {"position_rms_m", frame.position_rms_m},
                    {"band95", at(test.band_total, i)},
                    {"converged", frame.outcome.converged},
                    {"stable", frame.outcome.stable}});
  }
  return rows;
}

/// Half-widths of the 95 % band are means over the frames.
nlohmann::json testToJson(const EvaluatedTest& test, bool predictions) {
  nlohmann::json json = residualToJson(test.residual);
  const bool banded = !test.band_total.empty();
  json["band_coverage"] = banded ? test.coverage : std::numeric_limits<double>::quiet_NaN();
  json["band95_N"] = meanOf(test.band_total);
  json["band95_parameters_N"] = meanOf(test.band_parameters);
  json["band95_law_N"] = meanOf(test.band_law);
  if (predictions) json["predictions"] = framesToJson(test);
  return json;
}

void say(const EvaluatedTest& test, const Console& console) {
  std::string line = residualLine(test.residual);
  if (!test.band_total.empty() && !std::isnan(test.coverage)) {
    char text[96];
    std::snprintf(text, sizeof text, "; 95 %% band +- %.3g N covers %.0f %%",
                  meanOf(test.band_total), 100.0 * test.coverage);
    line += text;
  }
  console.say(line);
}

Result<int> run(const Options& o, Console& console) {
  stopCatchingInterrupts();
  std::vector<std::string> folders = o.measurements;
  for (const std::string& truth : o.truths) folders.push_back(truth + "/exact");
  if (folders.empty()) return usageError("there is no measurement to evaluate against");
  const auto material = readMaterial(o.material);
  if (!material) return material.error();
  const auto measurements = readMeasurements(folders);
  if (!measurements) return measurements.error();
  EvaluationOptions options;
  options.test = o.simulation.inSi();
  options.threads = o.simulation.threads;
  options.predictions = o.predictions;
  const auto tests = evaluateMaterial(*material, *measurements, options);
  if (!tests) return tests.error().file.empty() ? tests.error().in(o.material) : tests.error();

  auto& rows = console.answer["tests"] = nlohmann::json::array();
  int unconverged = 0;
  for (const EvaluatedTest& test : *tests) {
    rows.push_back(testToJson(test, o.predictions));
    say(test, console);
    unconverged += test.residual.unconverged_frames;
  }
  if (unconverged == 0) return kDone;
  console.warn(counted(static_cast<std::size_t>(unconverged), "frame") + " did not converge");
  return static_cast<int>(ErrorKind::kNotConverged);
}

}  // namespace

Verb evaluateVerb() {
  return {"evaluate", "Compare a material's predictions with measurements",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
