// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/reconstruction/rest_surface.h"

namespace tenter {

/// The sightings of a vertex at one moment.
struct TrackedSightings {
  std::vector<Sighting> now;           ///< With the covariances of their matches to rest.
  std::vector<std::size_t> places;     ///< Of each in the vertex's list of sightings at rest.
  std::vector<Mat2> now_from_rest_px;  ///< How each view's subset has been turned and stretched.

  void drop(std::size_t k);
};

/// Covariance of a vertex that was triangulated from sightings which were followed from rest
/// (docs/reconstruction.md): the noise of the images at rest moved the vertex there already, and
/// along the surface it was put on its node since.
/// @param gradient  Takes vectors along the surface from rest to the moment; zero across.
Mat3 trackedCovariance(const std::vector<CameraView>& views, const RestSurface& surface, int vertex,
                       const Vec3& position_m, const TrackedSightings& seen, const Mat3& gradient);

}  // namespace tenter
