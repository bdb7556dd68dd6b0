// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "command.h"

namespace tenter::app {

// Rows of `tenter calibrate` that are about forces, calibrate_<name>.cpp.
Verb cellsCalibration();
Verb cordsCalibration();

}  // namespace tenter::app
