// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "tenter/twin/capture.h"
#include "tenter/twin/scene_renderer.h"

namespace tenter {

struct ImageSessionOptions {
  CaptureOptions capture;    ///< Of frames counts the test's; the one at rest comes on top.
  RigCameraOptions cameras;  ///< Their protocol and seed are those of `capture`.
  RenderOptions render;      ///< Its seed is that of `capture`.
  double calibration_error_px = 0.02;  ///< Of the calibration that the session carries; 0 to 5.
  /// A calibration to carry in its place. Its cameras are those of the rig by name and size.
  std::optional<CameraCalibration> calibration;
  std::string protocol_text;  ///< For the header.
  std::string start_utc;      ///< For the header.
  std::filesystem::path session;
  std::filesystem::path truth;                               ///< Empty: the truth is not kept.
  std::function<void(double, const std::string&)> progress;  ///< Share done, of what. May be empty.
};

struct ImageSessionSummary {
  int frames = 0, cameras = 0;
  double feature_m = 0.0;
  double simulation_s = 0.0, rendering_s = 0.0;
};

/// Simulates a protocol, renders it and writes a session with images, its mounting and its
/// calibration, and the truth beside it. Frame 0 shows the sample at rest without clips; frame i +
/// 1 is the measurement's frame i. The session is one that a rig might have left: each frame's
/// sample has the tensions of noisy cells behind pulleys with friction. When it is cancelled while
/// it renders, the session ends with the last whole frame. Errors: those of a capture; a folder
/// that is not empty; a calibration of other cameras; kNotConverged when cancelled.
Result<ImageSessionSummary> captureImageSession(const ImageSessionOptions& options);

}  // namespace tenter
