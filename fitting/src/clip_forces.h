// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "simulated_test.h"
#include "tenter/core/measurement.h"

namespace tenter {

/// Forces and torques that the cords of each clip exert, stacked: force [N], then torque about the
/// rig's origin [N m], six rows a clip. Clips without cords are left out.
struct ClipForces {
  std::vector<int> clips;  ///< Indices into the frame's clips, which are the system's.
  bool all_have_cords = false;
  Eigen::VectorXd measured;    ///< 6 a clip.
  Eigen::MatrixXd covariance;  ///< Of the measurement: tensions, directions, and clip poses once
                               ///< addPoseErrors() was called.
};
ClipForces measuredForces(const MeasurementFrame& frame);

/// What the cords must exert for equilibrium.
Eigen::VectorXd predictedForces(const SolvedFrame& solved, const std::vector<int>& clips);
Eigen::MatrixXd predictedForcesByParameter(const SolvedFrame& solved,
                                           const std::vector<int>& clips);

/// Error of a clip's pose, a translation and a rotation about the middle of the nodes that it
/// holds, as motions of the system.
struct PoseErrors {
  Eigen::MatrixXd positions;  ///< 3 nodes x 6 clips, each column scaled by its standard deviation.
  Eigen::MatrixXd forces;     ///< predictedForces() rows x 6 clips, scaled likewise.
};
/// Precondition: the solver's last factorisation is that of the state. Empty when poses have no
/// error.
PoseErrors poseErrors(const SolvedFrame& solved, const Measurement& measurement,
                      const std::vector<int>& clips, bool with_forces);

}  // namespace tenter
