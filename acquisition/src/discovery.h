// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "tenter/acquisition/camera.h"

namespace tenter {

/// What the driver opens the camera by: GigE cameras by address (their id depends on the network
/// that they were found on), others by id. Looks on all buses if only a serial number is given.
Result<std::string> openableName(const CameraConfig& config);

}  // namespace tenter
