// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>
#include <vector>

#include "command.h"
#include "tenter/calib/camera_calibration.h"

namespace tenter::app {

/// What a file must contain for a command to overwrite it with a calibration.
inline constexpr std::string_view kCalibrationMarker = "\"tenter-camera-calibration\"";

nlohmann::json rejectedJson(const std::vector<RejectedImage>& rejected);
/// One warning an image.
void warnOfRejected(const std::vector<RejectedImage>& rejected, const Console& console);

/// Fills the answer and tells a person: cameras, errors, verdict.
void reportCalibration(const CameraCalibration& calibration, const std::string& file,
                       Console& console);

}  // namespace tenter::app
