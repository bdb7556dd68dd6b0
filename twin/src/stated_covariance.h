// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "tenter/calib/camera_calibration.h"

namespace tenter {

/// How one camera's calibration errs, independent of all others: standard deviations.
struct StatedError {
  Eigen::Isometry3d camera_from_rig;
  std::array<double, 9> lens{};                    ///< fx fy cx cy [px], k1 k2 p1 p2 k3.
  double rotation_rad = 0.0, translation_m = 0.0;  ///< camera_from_rig = [exp(r) R | t + d].
};

/// Writes what cameras of a rig err by as a calibration has it, whose world is the first camera:
/// parameters and joint covariance, the rig's pose last.
void stateCovariance(const std::vector<StatedError>& errors, CameraCalibration& calibration);

}  // namespace tenter
