// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_covariance.h"

#include <string>

#include "tenter/calib/calibration_parameters.h"
#include "tenter/core/cross_matrix.h"

namespace tenter {
namespace {

constexpr Eigen::Index kLens = kLensParameters.size(), kPose = kPoseParameters.size();

}  // namespace

void stateCovariance(const std::vector<StatedError>& errors, CameraCalibration& calibration) {
  const auto cameras = static_cast<Eigen::Index>(errors.size());
  const Eigen::Index size = cameras * (kLens + kPose), own = kLens + kPose;
  Eigen::VectorXd variances(size);
  // Of what a calibration states by the cameras' own errors.
  Eigen::MatrixXd change = Eigen::MatrixXd::Zero(size, size);
  const Eigen::Isometry3d& world = errors.front().camera_from_rig;
  Eigen::Index row = 0;
  for (Eigen::Index i = 0; i < cameras; ++i) {
    const StatedError& error = errors[static_cast<std::size_t>(i)];
    const std::string& name = calibration.cameras[static_cast<std::size_t>(i)].name;
    for (Eigen::Index k = 0; k < kLens; ++k) {
      const double sigma = error.lens[static_cast<std::size_t>(k)];
      variances[own * i + k] = sigma * sigma;
    }
    nameParameters(name, kLensParameters, calibration.parameters);
    variances.segment<3>(own * i + kLens).setConstant(error.rotation_rad * error.rotation_rad);
    variances.segment<3>(own * i + kLens + 3)
        .setConstant(error.translation_m * error.translation_m);
    change.block<kLens, kLens>(row, own * i).setIdentity();
    row += kLens;
    if (i == 0) continue;
    // Q = R_i R_1^T: rotation r_i - Q r_1, displacement d_i - Q d_1 + [Q t_1]x rotation.
    nameParameters(name, kPoseParameters, calibration.parameters);
    const Mat3 q = error.camera_from_rig.linear() * world.linear().transpose();
    const Mat3 arm = crossMatrix(q * world.translation());
    change.block<3, 3>(row, own * i + kLens).setIdentity();
    change.block<3, 3>(row, kLens) = -q;
    change.block<3, 3>(row + 3, own * i + kLens + 3).setIdentity();
    change.block<3, 3>(row + 3, kLens + 3) = -q;
    change.block<3, 3>(row + 3, own * i + kLens) = arm;
    change.block<3, 3>(row + 3, kLens) = -arm * q;
    row += kPose;
  }
  nameParameters(std::string(kRigPose), kPoseParameters, calibration.parameters);
  change.block<kPose, kPose>(row, kLens).setIdentity();
  const Eigen::MatrixXd covariance = change * variances.asDiagonal() * change.transpose();
  calibration.covariance = 0.5 * (covariance + covariance.transpose());
}

}  // namespace tenter
