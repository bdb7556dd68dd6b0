// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/reconstruction/rest_surface.h"

namespace tenter {

/// How far sightings lie from the projections of what they were triangulated to, taken apart: what
/// varies linearly over a view's image is the calibration's, the rest is the matches' noise.
class ViewOffsets {
 public:
  ViewOffsets(const std::vector<CameraView>& views, const std::vector<RestVertex>& vertices);

  /// Standard deviation per axis of offsets that leave these linear parts; three of a vertex's
  /// numbers went into its place.
  double offsetPx() const { return offset_px_; }
  /// Of a valid vertex: sum of squared residuals, linear parts taken out, over their covariance.
  double chi2(const RestVertex& vertex) const;

 private:
  using Linear = Eigen::Matrix<double, 3, 2>;  ///< By 1, x, y of the scaled pixel.
  Eigen::Vector3d placeOf(const Sighting& sighting) const;
  std::optional<Vec2> residualOf(const RestVertex& vertex, const Sighting& sighting) const;

  const std::vector<CameraView>& views_;
  std::vector<Linear> linear_;
  double offset_px_ = 0.0;
};

}  // namespace tenter
