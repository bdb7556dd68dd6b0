// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/moving_obstacle.h"

#include <algorithm>

namespace tenter {

Eigen::Isometry3d ObstacleMotion::pose(double time_s) const {
  const double t = std::min(time_s, halt_s);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const double rate = angular_velocity_rad_per_s.norm();
  if (rate > 0.0)
    pose.linear() =
        Eigen::AngleAxisd(rate * t, angular_velocity_rad_per_s / rate).toRotationMatrix();
  pose.translation() = pivot_m + t * velocity_m_per_s - pose.linear() * pivot_m;
  return pose;
}

Vec3 ObstacleMotion::velocityAt(const Vec3& place_m, double time_s) const {
  if (time_s > halt_s) return Vec3::Zero();
  return velocity_m_per_s +
         angular_velocity_rad_per_s.cross(place_m - pivot_m - time_s * velocity_m_per_s);
}

Obstacle::Nearest MovingObstacle::nearest(const Vec3& place_m, double time_s) const {
  if (!motion.moves()) return body->nearest(place_m);
  const Eigen::Isometry3d world = motion.pose(time_s);
  Obstacle::Nearest near = body->nearest(world.inverse() * place_m);
  near.point = world * near.point;
  near.normal = world.linear() * near.normal;
  return near;
}

}  // namespace tenter
