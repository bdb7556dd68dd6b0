// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "command.h"
#include "tenter/fitting/fit.h"

namespace tenter::app {

/// Options that fit and evaluate share: how a measurement becomes a simulation.
struct SimulationOptions {
  FitTestOptions test;
  std::string diagonals = "uniform";
  int threads = 2;

  FitTestOptions inSi() const;
};
void declareSimulation(CLI::App& command, SimulationOptions& options);

/// Reads all folders; the first error ends it.
Result<std::vector<Measurement>> readMeasurements(const std::vector<std::string>& folders);

/// Residuals of one test as both verbs tell them; null for what was not measured.
nlohmann::json residualToJson(const TestResidual& residual);
/// "m30: force 0.53 % of the peak ..., 78 frames".
std::string residualLine(const TestResidual& residual);

}  // namespace tenter::app
