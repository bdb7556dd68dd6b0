// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "command.h"
#include "tenter/twin/virtual_cameras.h"

namespace tenter::app {

/// Options of virtual cameras.
struct CameraSourceOptions {
  int cameras = 0;
  std::string images = "test-pattern";
  int width_px = 0, height_px = 0;  ///< 0: of the pictures, or the cameras' usual size.
};

/// `default_count` cameras unless --cameras says otherwise.
void declareCameraSource(CLI::App& command, CameraSourceOptions& o, int default_count);

/// Error: --images names nothing that can be shown.
Result<VirtualCamerasOptions> camerasOf(const CameraSourceOptions& o, std::uint64_t seed);

}  // namespace tenter::app
