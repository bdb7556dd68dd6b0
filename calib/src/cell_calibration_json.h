// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "tenter/calib/cell_calibration.h"

namespace tenter {

/// The id that this content has.
std::string idOf(const CellCalibration& calibration);

}  // namespace tenter
