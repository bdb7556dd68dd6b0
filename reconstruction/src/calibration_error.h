// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "tenter/reconstruction/rest_surface.h"

namespace tenter {

/// What a calibration's own uncertainty makes of triangulated places: with the projections pi of a
/// point X and calibration parameters p,  J dX + (d pi / d p) dp = 0  in the least squares of
/// triangulate(), so  Cov(X) = B Cov(p) B^T,  B = (J^T W J)^-1 J^T W (d pi / d p)
/// (docs/reconstruction.md).
class CalibrationError {
 public:
  /// Nothing if the calibration does not state a covariance, or not of all of these views.
  static std::optional<CalibrationError> create(const CameraCalibration& calibration,
                                                const std::vector<CameraView>& views);

  /// Of a point in space that is triangulated from these sightings; zero where it cannot be seen.
  Mat3 covarianceAt(const Vec3& point_m, std::span<const VertexSighting> sightings) const;

 private:
  static constexpr int kLensTerms = 9;  ///< fx fy cx cy k1 k2 p1 p2 k3.
  struct View {
    CameraView view;
    Eigen::Isometry3d camera_from_world;
    Eigen::Index lens = 0, pose = -1;     ///< First row in the covariance; -1: the world itself.
    std::vector<CameraModel> more, less;  ///< One term changed by `step` up and down.
    std::vector<double> step;
  };

  /// d(pixel)/d(parameters), 2 x all.
  using PixelRows = Eigen::Matrix<double, 2, Eigen::Dynamic>;
  bool pixelByParameters(const View& view, const Vec3& point_m, PixelRows& rows) const;

  std::vector<View> views_;
  std::optional<Eigen::Isometry3d> world_from_rig_;
  Eigen::Index rig_ = -1;
  Eigen::MatrixXd covariance_;
};

/// Notes it at every valid vertex (RestVertex::calibration_m2).
void addCalibrationError(const CalibrationError& error, RestSurface& surface);

}  // namespace tenter
