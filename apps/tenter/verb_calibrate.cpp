// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "force_calibration.h"
#include "verbs.h"

namespace tenter::app {

Verb calibrateVerb() {
  return {"calibrate",
          "Cameras from images of a board; load cells from dead weights; cords from a record",
          [](CLI::App& command, Action& action) {
            static const std::array kRows = {camerasCalibration(), importedCalibration(),
#ifdef TENTER_HARDWARE
                                             cordsCalibration(),
#endif
                                             cellsCalibration()};
            command.require_subcommand(1);
            addSubcommands(command, kRows, action);
          }};
}

}  // namespace tenter::app
