// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

#include "tenter/calib/camera_calibration.h"

namespace tenter::calibration_json {

inline constexpr std::string_view kFormat = "tenter-camera-calibration", kUnits = "SI";
inline constexpr std::string_view kAccepted = "accepted", kRejected = "rejected";
inline constexpr int kMaxCameras = 64;

nlohmann::ordered_json encode(const CameraCalibration& calibration);
Result<CameraCalibration> decode(const nlohmann::json& document, const std::string& file);

}  // namespace tenter::calibration_json
