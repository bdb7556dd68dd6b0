// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "verbs.h"

namespace tenter::app {

Verb calibrateVerb() {
  return {"calibrate", "Cameras from images of a board, or from another program's file",
          [](CLI::App& command, Action& action) {
            static const std::array kRows = {camerasCalibration(), importedCalibration()};
            command.require_subcommand(1);
            addSubcommands(command, kRows, action);
          }};
}

}  // namespace tenter::app
