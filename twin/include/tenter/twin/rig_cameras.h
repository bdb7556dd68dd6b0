// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/calib/camera_calibration.h"

namespace tenter {

/// A camera of the virtual rig as it truly is.
struct VirtualCamera {
  std::string name;  ///< "cam-1".
  CameraModel model;
  Eigen::Isometry3d camera_from_rig = Eigen::Isometry3d::Identity();
  double aperture_m = 0.0;  ///< Diameter of the entrance pupil; 0: everything is in focus.
  double focus_m = 0.5;     ///< Distance of the plane in focus, along the optical axis.
  double exposure = 1.0;    ///< 1: white paper in full light is four fifths of the range.
};

struct RigCameraOptions {
  std::string protocol = "stretch-weft";  ///< The table tests are looked at from where it hangs.
  int count = 4;                          ///< 2 to 8.
  int width_px = 1936;                    ///< 320 to 4096; 1.6 times the height.
  std::uint64_t seed = 1;                 ///< Of how lenses and places differ from the drawing.
};

/// Cameras around and above the sample: 25 mm lenses at f/16 on sensors of 11.3 mm, 0.58 m
/// off, 0.136 mm a pixel at full width. Each point of a taut sample is seen by all of them. Errors:
/// no such protocol, counts or sizes out of range.
Result<std::vector<VirtualCamera>> rigCameras(const RigCameraOptions& options);

/// The place that the cameras of a protocol look at, in the rig's frame [m].
Vec3 rigFocus(std::string_view protocol);

/// What a calibration of these cameras would say, with errors of `error_px`: lenses and poses are
/// moved so that points around `focus` are projected that far off (root mean square, one camera).
/// The world is the first camera's frame, the rig is known from there. 0: the truth.
CameraCalibration calibrationOf(const std::vector<VirtualCamera>& cameras, const Vec3& focus,
                                double error_px, std::uint64_t seed);

}  // namespace tenter
