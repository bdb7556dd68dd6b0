// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "command.h"
#include "tenter/twin/capture.h"

namespace tenter::app {

/// What the virtual cameras are asked for.
struct ImageOptions {
  int boards = 0;  ///< 0: no boards.
  int cameras = 4, width_px = 1936, rays = 2;
  double feature_mm = 0.0, calibration_error_px = 0.02;
  std::string calibration;
};

void declareImages(CLI::App& command, ImageOptions& o);

/// A session with images, straight to files.
Result<int> captureImages(const CaptureOptions& capture, const ImageOptions& images,
                          const std::string& output, const std::string& truth, Console& console);

/// Images of a calibration board in the cameras of a protocol.
Result<int> captureBoards(const CaptureOptions& capture, const ImageOptions& images,
                          const std::string& output, const std::string& truth, Console& console);

}  // namespace tenter::app
