// SPDX-License-Identifier: GPL-3.0-or-later
#include "rig_noise.h"

#include <algorithm>
#include <cmath>

#include "random_numbers.h"

namespace tenter {
namespace {

Mat3 smallRotation(const Vec3& vector) {
  const double angle = vector.norm();
  if (angle == 0.0) return Mat3::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

/// A clip turns about its own middle, which is where its tags are.
void disturbPose(const Vec3& centre_in_rig, RandomNumbers& random, Eigen::Isometry3d& pose) {
  const Mat3 turn = smallRotation(RigErrors::kClipRotation_rad * random.normal3());
  const Vec3 shift = RigErrors::kClipPosition_m * random.normal3();
  pose.translation() = turn * (pose.translation() - centre_in_rig) + centre_in_rig + shift;
  pose.linear() = Eigen::Quaterniond(turn * pose.linear()).normalized().toRotationMatrix();
}

Vec3 middleOf(const ClipReading& clip, const MeasurementFrame& frame) {
  Vec3 sum = Vec3::Zero();
  for (const int v : clip.clamped_vertices) sum += frame.positions.col(v);
  return clip.clamped_vertices.empty()
             ? Vec3(clip.rig_from_clip.translation())
             : Vec3(sum / static_cast<double>(clip.clamped_vertices.size()));
}

}  // namespace

void stateSigmas(Measurement& measurement) {
  measurement.clip_position_sigma_m = RigErrors::kClipPosition_m;
  measurement.clip_rotation_sigma_rad = RigErrors::kClipRotation_rad;
  for (MeasurementFrame& frame : measurement.frames) {
    const Eigen::Index n = frame.positions.cols();
    frame.position_sigma_m = Eigen::VectorXd::Constant(n, RigErrors::kVertex_m);
    frame.valid.assign(static_cast<std::size_t>(n), 1);
    for (CordReading& cord : frame.cords) cord.tension_sigma_N = RigErrors::kCell_N;
  }
}

void addNoise(const CaptureOptions& options, std::size_t index,
              const std::vector<double>& cord_motion, MeasurementFrame& frame) {
  RandomNumbers random(options.seed, "noise " + options.fabric + " " + options.protocol + " " +
                                         std::to_string(index));
  for (ClipReading& clip : frame.clips)
    disturbPose(middleOf(clip, frame), random, clip.rig_from_clip);
  for (Eigen::Index v = 0; v < frame.positions.cols(); ++v) {
    frame.positions.col(v) += RigErrors::kVertex_m * random.normal3();
  }
  const double friction = options.cord_friction ? RigErrors::kCordFriction_N : 0.0;
  for (std::size_t k = 0; k < frame.cords.size(); ++k) {
    CordReading& cord = frame.cords[k];
    const Vec3 turn = RigErrors::kDirection_rad * random.normal3();
    cord.direction = (cord.direction + turn.cross(cord.direction)).normalized();
    cord.tension_N = std::max(0.0, cord.tension_N + friction * cord_motion[k]);
    cord.tension_N += RigErrors::kCell_N * random.normal();
    cord.tension_sigma_N = std::hypot(RigErrors::kCell_N, friction);
  }
}

}  // namespace tenter
