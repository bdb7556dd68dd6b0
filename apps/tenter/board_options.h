// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "command.h"
#include "tenter/calib/board.h"

namespace tenter::app {

/// A calibration board in the words and units of the command line.
struct BoardOptions {
  std::string kind = "chessboard", corners, dictionary = "4x4_50";
  double square_mm = 0.0, marker_mm = 0.0;

  /// Checked; errors of kind kUsage name the option.
  Result<Board> board() const;
};
void declareBoard(CLI::App& command, BoardOptions& options);

}  // namespace tenter::app
