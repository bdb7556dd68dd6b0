// SPDX-License-Identifier: GPL-3.0-or-later
#include "clip_forces.h"

#include <cmath>

#include "tenter/core/cross_matrix.h"

namespace tenter {
namespace {

/// Of load cells where the measurement states none [Est12] sec. 3.3.
constexpr double kDefaultTension_N = 3e-3;
/// Of the observed direction of a cord, per transverse axis; measurements do not state it.
constexpr double kDirection_rad = 5e-4;
/// Added to every force component: what no listed cause explains, and what keeps slack cords'
/// covariance regular.
constexpr double kFloor_N = 3e-4;
/// Arm that turns that floor into one of torque: half the paper's sample.
constexpr double kFloorArm_m = 0.05;

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

Vec6 wrenchOf(const Vec3& force, const Vec3& place) {
  Vec6 wrench;
  wrench << force, place.cross(force);
  return wrench;
}

Mat6 cordCovariance(const CordReading& cord, const Vec3& place) {
  const double sigma = cord.tension_sigma_N > 0.0 ? cord.tension_sigma_N : kDefaultTension_N;
  const Vec6 along = wrenchOf(cord.direction, place);
  Mat6 covariance = sigma * sigma * along * along.transpose();
  const Vec3 first = cord.direction.unitOrthogonal(), second = cord.direction.cross(first);
  for (const Vec3& across : {first, second}) {
    const Vec6 turned = wrenchOf(cord.tension_N * kDirection_rad * across, place);
    covariance += turned * turned.transpose();
  }
  return covariance;
}

Vec3 centreOfClip(const SolvedFrame& solved, int clip) {
  Vec3 centre = Vec3::Zero();
  const std::vector<int>& nodes = solved.simulation.system.setup().clips[clip].nodes;
  for (const int node : nodes) centre += solved.state.q.segment<3>(3 * node);
  return nodes.empty() ? centre : Vec3(centre / static_cast<double>(nodes.size()));
}

/// Columns: translation and rotation about `centre`, one standard deviation each; rows: the
/// system's pose coordinates, which turn about the rig's origin: t + w x (x - c) = (t + c x w) + w
/// x x.
Mat6 scaledPose(const Measurement& m, const Vec3& centre) {
  Mat6 pose = Mat6::Zero();
  pose.topLeftCorner<3, 3>() = m.clip_position_sigma_m * Mat3::Identity();
  pose.bottomRightCorner<3, 3>() = m.clip_rotation_sigma_rad * Mat3::Identity();
  pose.topRightCorner<3, 3>() = m.clip_rotation_sigma_rad * crossMatrix(centre);
  return pose;
}

void addRigidMotion(const SolvedFrame& solved, int clip, const Mat6& pose,
                    Eigen::Ref<Eigen::MatrixXd> positions) {
  for (const int node : solved.simulation.system.setup().clips[clip].nodes) {
    Eigen::Matrix<double, 3, 6> motion;
    motion << Mat3::Identity(), -crossMatrix(solved.state.q.segment<3>(3 * node));
    positions.middleRows<3>(3 * node) = motion * pose;
  }
}

}  // namespace

ClipForces measuredForces(const MeasurementFrame& frame) {
  ClipForces forces;
  std::vector<Vec6> wrenches;
  std::vector<Mat6> covariances;
  for (std::size_t c = 0; c < frame.clips.size(); ++c) {
    Vec6 wrench = Vec6::Zero();
    Vec6 floor;
    floor << Vec3::Constant(kFloor_N * kFloor_N),
        Vec3::Constant(std::pow(kFloor_N * kFloorArm_m, 2));
    Mat6 covariance = floor.asDiagonal();
    bool any = false;
    for (const CordReading& cord : frame.cords) {
      if (cord.clip != frame.clips[c].clip) continue;
      const Vec3 place = frame.clips[c].rig_from_clip * cord.attachment_m;
      wrench += wrenchOf(cord.tension_N * cord.direction, place);
      covariance += cordCovariance(cord, place);
      any = true;
    }
    if (!any) continue;
    forces.clips.push_back(static_cast<int>(c));
    wrenches.push_back(wrench);
    covariances.push_back(covariance);
  }
  const Eigen::Index rows = 6 * static_cast<Eigen::Index>(wrenches.size());
  forces.all_have_cords = forces.clips.size() == frame.clips.size();
  forces.measured.resize(rows);
  forces.covariance.setZero(rows, rows);
  for (std::size_t i = 0; i < wrenches.size(); ++i) {
    const Eigen::Index row = 6 * static_cast<Eigen::Index>(i);
    forces.measured.segment<6>(row) = wrenches[i];
    forces.covariance.block<6, 6>(row, row) = covariances[i];
  }
  return forces;
}

Eigen::VectorXd predictedForces(const SolvedFrame& solved, const std::vector<int>& clips) {
  Eigen::VectorXd all(6 * static_cast<Eigen::Index>(clips.size()));
  for (std::size_t i = 0; i < clips.size(); ++i) {
    const Wrench wrench = solved.simulation.system.clipWrench(solved.state, clips[i]);
    all.segment<6>(6 * static_cast<Eigen::Index>(i)) << -wrench.force_N, -wrench.torque_N_m;
  }
  return all;
}

Eigen::MatrixXd predictedForcesByParameter(const SolvedFrame& solved,
                                           const std::vector<int>& clips) {
  Eigen::MatrixXd all(6 * static_cast<Eigen::Index>(clips.size()),
                      solved.dofs_by_parameter->cols());
  for (std::size_t i = 0; i < clips.size(); ++i)
    all.middleRows<6>(6 * static_cast<Eigen::Index>(i)) =
        -solved.simulation.system.clipWrenchByParameter(solved.state, clips[i],
                                                        *solved.dofs_by_parameter);
  return all;
}

PoseErrors poseErrors(const SolvedFrame& solved, const Measurement& m,
                      const std::vector<int>& clips, bool with_forces) {
  PoseErrors errors;
  if (!(m.clip_position_sigma_m > 0.0) && !(m.clip_rotation_sigma_rad > 0.0)) return errors;
  const ClothSystem& system = solved.simulation.system;
  const int count = static_cast<int>(system.setup().clips.size());
  errors.positions.setZero(3 * system.sheet().nodeCount(), 6 * count);
  errors.forces.setZero(with_forces ? 6 * static_cast<Eigen::Index>(clips.size()) : 0, 6 * count);
  for (int moved = 0; moved < count; ++moved) {
    const Mat6 pose = scaledPose(m, centreOfClip(solved, moved));
    const Eigen::MatrixXd dofs =
        -solved.simulation.solver.solveLinear(system.gradientByPose(solved.state, moved));
    errors.positions.middleCols<6>(6 * moved) = system.positionsByDof(solved.state, dofs) * pose;
    addRigidMotion(solved, moved, pose, errors.positions.middleCols<6>(6 * moved));
    for (std::size_t i = 0; with_forces && i < clips.size(); ++i)
      errors.forces.block<6, 6>(6 * static_cast<Eigen::Index>(i), 6 * moved) =
          -system.clipWrenchByPose(solved.state, clips[i], moved, dofs) * pose;
  }
  return errors;
}

}  // namespace tenter
