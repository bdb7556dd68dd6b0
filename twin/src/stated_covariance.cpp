// SPDX-License-Identifier: GPL-3.0-or-later
#include "stated_covariance.h"

#include <string>

namespace tenter {
namespace {

constexpr Eigen::Index kLens = 9, kPose = 6;
constexpr std::array<const char*, 9> kLensNames{"fx_px", "fy_px", "cx_px", "cy_px", "k1",
                                                "k2",    "p1",    "p2",    "k3"};

Mat3 cross(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

void namePose(const std::string& of, std::vector<std::string>& names) {
  for (const char* part : {".rotation_rad", ".translation_m"})
    for (const char* axis : {"[0]", "[1]", "[2]"}) names.push_back(of + part + axis);
}

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
      calibration.parameters.push_back(name + "." + kLensNames[static_cast<std::size_t>(k)]);
    }
    variances.segment<3>(own * i + kLens).setConstant(error.rotation_rad * error.rotation_rad);
    variances.segment<3>(own * i + kLens + 3)
        .setConstant(error.translation_m * error.translation_m);
    change.block<kLens, kLens>(row, own * i).setIdentity();
    row += kLens;
    if (i == 0) continue;
    // Q = R_i R_1^T: rotation r_i - Q r_1, displacement d_i - Q d_1 + [Q t_1]x rotation.
    namePose(name, calibration.parameters);
    const Mat3 q = error.camera_from_rig.linear() * world.linear().transpose();
    const Mat3 arm = cross(q * world.translation());
    change.block<3, 3>(row, own * i + kLens).setIdentity();
    change.block<3, 3>(row, kLens) = -q;
    change.block<3, 3>(row + 3, own * i + kLens + 3).setIdentity();
    change.block<3, 3>(row + 3, kLens + 3) = -q;
    change.block<3, 3>(row + 3, own * i + kLens) = arm;
    change.block<3, 3>(row + 3, kLens) = -arm * q;
    row += kPose;
  }
  namePose(std::string(kRigPose), calibration.parameters);
  change.block<kPose, kPose>(row, kLens).setIdentity();
  const Eigen::MatrixXd covariance = change * variances.asDiagonal() * change.transpose();
  calibration.covariance = 0.5 * (covariance + covariance.transpose());
}

}  // namespace tenter
