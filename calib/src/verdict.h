// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/calib/calibrate_cameras.h"

namespace tenter {

/// Fills `accepted`, `reasons` and `warnings` from what the calibration says of itself.
void judge(const std::vector<CameraPhotos>& photos, const CameraCalibrationOptions& options,
           CameraCalibration& calibration);

}  // namespace tenter
