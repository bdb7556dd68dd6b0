// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_options.h"

#include <cmath>
#include <cstdio>

#include "interrupt.h"

namespace tenter::app {

FitTestOptions SimulationOptions::inSi() const {
  FitTestOptions options = test;
  options.diagonals =
      diagonals == "uniform" ? DiagonalPattern::kUniform : DiagonalPattern::kAlternating;
  return options;
}

void declareSimulation(CLI::App& command, SimulationOptions& o) {
  command.add_option("--nodes", o.test.nodes, "Nodes a side of the simulated cloth")
      ->check(CLI::Range(5, 400))
      ->capture_default_str();
  command.add_option("--diagonals", o.diagonals, "Diagonals of the simulated cloth")
      ->check(CLI::IsMember({"uniform", "alternating"}))
      ->capture_default_str();
  command.add_option("--max-frames", o.test.max_frames, "Evenly chosen frames of each; 0: all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_option("--threads", o.threads, "Threads")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
}

Result<std::vector<Measurement>> readMeasurements(const std::vector<std::string>& folders) {
  std::vector<Measurement> measurements;
  for (const std::string& folder : folders) {
    if (interrupted())
      return notConverged("stopped while measurements were read; nothing was written");
    auto measurement = readMeasurement(folder);
    if (!measurement) return measurement.error();
    measurements.push_back(std::move(measurement).value());
  }
  return measurements;
}

nlohmann::json residualToJson(const TestResidual& r) {
  return {{"measurement", r.measurement},
          {"specimen", r.specimen},
          {"protocol", r.protocol},
          {"frames", r.frames},
          {"force_nrmse", r.force_nrmse},
          {"force_rms_N", r.force_rms_N},
          {"position_rms_m", r.position_rms_m},
          {"chi2_per_dof", r.chi2_per_dof},
          {"discrepancy_m", r.discrepancy_m},
          {"unconverged_frames", r.unconverged_frames},
          {"unstable_frames", r.unstable_frames},
          {"multistable_frames", r.multistable_frames}};
}

std::string residualLine(const TestResidual& r) {
  char text[96];
  std::string line = r.measurement + ":";
  if (!std::isnan(r.force_nrmse)) {
    std::snprintf(text, sizeof text, " force %.3g %% of the peak (%.3g N),", 100.0 * r.force_nrmse,
                  r.force_rms_N);
    line += text;
  }
  if (!std::isnan(r.position_rms_m)) {
    std::snprintf(text, sizeof text, " position %.3g mm,", 1e3 * r.position_rms_m);
    line += text;
  }
  line += " " + counted(static_cast<std::size_t>(r.frames), "frame");
  if (r.unconverged_frames > 0) {
    line += ", " + std::to_string(r.unconverged_frames) + " did not converge";
  }
  return line;
}

}  // namespace tenter::app
