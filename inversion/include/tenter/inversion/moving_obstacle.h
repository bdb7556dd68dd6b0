// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <memory>

#include "tenter/inversion/obstacle.h"

namespace tenter {

/// A rigid motion that starts at time 0 from the place where the obstacle was described, with
/// constant velocities, and halts.
struct ObstacleMotion {
  Vec3 velocity_m_per_s = Vec3::Zero();  ///< Of the pivot.
  Vec3 angular_velocity_rad_per_s = Vec3::Zero();
  Vec3 pivot_m = Vec3::Zero();  ///< Its place at time 0.
  double halt_s = std::numeric_limits<double>::infinity();

  bool moves() const {
    return !velocity_m_per_s.isZero(0.0) || !angular_velocity_rad_per_s.isZero(0.0);
  }
  Eigen::Isometry3d pose(double time_s) const;                ///< world_from_obstacle.
  Vec3 velocityAt(const Vec3& place_m, double time_s) const;  ///< [m/s].
};

/// A rigid body that a moving shell may touch.
struct MovingObstacle {
  std::unique_ptr<Obstacle> body;
  double friction = 0.0;  ///< Coulomb's mu where the shell's own contacts state no other.
  ObstacleMotion motion;

  Obstacle::Nearest nearest(const Vec3& place_m, double time_s) const;
};

}  // namespace tenter
