// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace tenter {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat2 = Eigen::Matrix2d;
using Mat3 = Eigen::Matrix3d;

/// Points of a mesh, one column a vertex: 3 x n positions [m], or 2 x n material coordinates (u, v)
/// [m], u = weft, v = warp.
using Points3 = Eigen::Matrix3Xd;
using Points2 = Eigen::Matrix2Xd;

/// Standard gravity [m/s^2], along -z of the rig unless a measurement says otherwise.
inline constexpr double kStandardGravity_m_per_s2 = 9.80665;
inline const Vec3 kDefaultGravity{0.0, 0.0, -kStandardGravity_m_per_s2};

}  // namespace tenter
