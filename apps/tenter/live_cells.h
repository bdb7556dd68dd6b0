// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "command.h"
#include "tenter/calib/cell_calibration.h"

namespace tenter::app {

/// Weights that somebody hangs on cells, one after the other.
struct LiveWeights {
  std::string socket;  ///< Of tenterd.
  std::vector<std::string> cells;
  std::vector<double> forces_N;
  std::optional<double> temperature_degC;
};

/// Asks on stderr for each weight, waits for a line on stdin, and reads the cell for a second.
/// Errors: no daemon, no such cell, a cell without a tension, stdin ends too early.
Result<std::vector<CellLoads>> weighLive(const LiveWeights& weights, Console& console);

}  // namespace tenter::app
