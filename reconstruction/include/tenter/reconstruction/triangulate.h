// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>

#include "tenter/reconstruction/camera_view.h"

namespace tenter {

/// Where one view shows a point.
struct Sighting {
  int view = 0;  ///< Into the list of views.
  Vec2 pixel = Vec2::Zero();
  Mat2 covariance_px2 = Mat2::Identity();
};

/// A point that several views show.
struct SpacePoint {
  Vec3 position_m = Vec3::Zero();
  Mat3 covariance_m2 = Mat3::Zero();  ///< From the sightings' covariances alone.
  /// Sum of squared residuals over their covariance; 2 sightings - 3 degrees of freedom.
  double chi2 = 0.0;
  double residual_px = 0.0;  ///< Root mean square distance of a sighting from the projection.
  int worst = 0;             ///< Sighting with the largest residual over its sigma.
};

/// The point nearest to all sightings in the sense of their covariances: Gauss-Newton on the
/// distances in the images, lens included, from `guess` or from where the rays pass nearest.
/// Nothing if there are fewer than two sightings, the rays are parallel, or a view cannot see the
/// point. Never allocates.
std::optional<SpacePoint> triangulate(std::span<const CameraView> views,
                                      std::span<const Sighting> sightings,
                                      const Vec3* guess = nullptr);

}  // namespace tenter
