// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "tenter/acquisition/camera.h"

namespace tenter {

/// What an image shows of its exposure and focus.
struct FrameQuality {
  double saturated_share = 0.0;  ///< Of the pixels, at the end of the scale.
  double mean = 0.0;             ///< Of the scale, 0 to 1.
  /// Mean squared gradient over variance, of the image at half size: independent of exposure and
  /// contrast, and hardly of noise [1/px^2]. 0 where nothing varies.
  double sharpness = 0.0;
};
FrameQuality frameQuality(const CameraImage& image);

/// Lossless PNG; 16 bits a pixel beyond 8, with the camera's values as they are.
Result<std::string> encodePng(const CameraImage& image);

}  // namespace tenter
