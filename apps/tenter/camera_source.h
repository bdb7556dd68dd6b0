// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>

#include "command.h"
#include "tenter/twin/served_rig.h"

namespace tenter::app {

/// Options of virtual cameras.
struct CameraSourceOptions {
  static constexpr const char *kScene = "scene", *kTestPattern = "test-pattern";
  int cameras = 0;
  std::string images = kTestPattern;
  int width_px = 0, height_px = 0;  ///< 0: of the pictures, or the cameras' usual size.
};

/// `default_count` cameras unless --cameras says otherwise.
void declareCameraSource(CLI::App& command, CameraSourceOptions& o, int default_count);

/// Of a rig in which a sample hangs: without any unless --cameras asks for them, and they see it.
void declareRigCameras(CLI::App& command, CameraSourceOptions& o);
/// Puts them into the rig's options. Error: as camerasOf.
Result<void> addCameras(const CameraSourceOptions& o, ServedRigOptions& rig);

/// Error: --images names nothing that can be shown.
Result<VirtualCamerasOptions> camerasOf(const CameraSourceOptions& o, std::uint64_t seed);

}  // namespace tenter::app
