// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "bundle.h"
#include "tenter/calib/camera_calibration.h"

namespace tenter {

/// Fits five times without a fifth of the sets and measures on those that were left out, only
/// their boards' poses fitted: fills the four held-out fields of `quality`. Leaves them absent with
/// fewer than six sets.
void measureHeldOut(const Bundle& fitted, const BundleOptions& options,
                    CalibrationQuality& quality);

/// The point that two or more cameras see at these pixels, in the world [m]: the least squares of
/// distances from rays, then of pixels. Nothing if the rays do not meet before the cameras.
struct Sighting {
  const CameraModel* model;
  Eigen::Isometry3d camera_from_world;
  Vec2 pixel;
};
std::optional<Vec3> triangulate(const std::vector<Sighting>& sightings);

}  // namespace tenter
