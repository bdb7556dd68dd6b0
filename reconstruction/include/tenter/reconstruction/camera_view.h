// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tenter/calib/camera_calibration.h"

namespace tenter {

/// One calibrated camera as a reconstruction sees through it. "Space" is the rig's frame if the
/// calibration knows where the rig is, otherwise the calibration's world.
struct CameraView {
  std::string name;
  CameraModel model;
  Eigen::Isometry3d camera_from_space;

  Vec3 centre() const { return camera_from_space.inverse().translation(); }
  /// Pixel of a point in space [m]; nothing if it cannot be seen. May lie outside of the image.
  /// @param jacobian  2 x 3, d(pixel)/d(point) [px/m], written if not null.
  std::optional<Vec2> project(const Vec3& point_m,
                              Eigen::Matrix<double, 2, 3>* jacobian = nullptr) const;
  /// Unit direction in space of the ray that ends in a pixel.
  std::optional<Vec3> direction(const Vec2& pixel) const;
};

/// Cameras of a calibration, in its order.
std::vector<CameraView> viewsOf(const CameraCalibration& calibration);

}  // namespace tenter
