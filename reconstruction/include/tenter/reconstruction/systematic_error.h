// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "tenter/calib/calibration_parameters.h"
#include "tenter/reconstruction/triangulate.h"

namespace tenter {

/// What errs alike in all frames and nearly so at all vertices: the calibration. With the
/// projections pi of a place X and parameters p,  J dX + (d pi / d p) dp = 0  in the least squares
/// of triangulate(), so  Cov(X) = B Cov(p) B^T,  B = (J^T W J)^-1 J^T W (d pi / d p)
/// (docs/reconstruction.md).
class SystematicError {
 public:
  /// By the calibration's own covariance. Nothing if it does not state one, or not of all views.
  static std::optional<SystematicError> ofCalibration(const CameraCalibration& calibration,
                                                      const std::vector<CameraView>& views);
  /// By how far views disagree: every view's pixels are off by an offset of its own, of this
  /// standard deviation per axis.
  static SystematicError ofOffsets(const std::vector<CameraView>& views, double offset_px);

  /// d(place)/d(parameters), 3 x all.
  using PlaceRows = Eigen::Matrix<double, 3, Eigen::Dynamic>;
  /// Of a point in space that is triangulated from these sightings; zero where it cannot be seen.
  PlaceRows placeByParameters(const Vec3& point_m, std::span<const Sighting> sightings) const;
  Mat3 covarianceOf(const PlaceRows& rows) const { return rows * covariance_ * rows.transpose(); }
  Mat3 covarianceAt(const Vec3& point_m, std::span<const Sighting> sightings) const {
    return covarianceOf(placeByParameters(point_m, sightings));
  }

 private:
  static constexpr int kLensTerms = kLensParameters.size();
  struct View {
    explicit View(const CameraView& seen_by) : view(seen_by) {}
    CameraView view;
    Eigen::Isometry3d camera_from_world = Eigen::Isometry3d::Identity();
    Eigen::Index offset = -1;             ///< First row of its offset in the covariance; -1: none.
    Eigen::Index lens = -1, pose = -1;    ///< Of its lens and pose.
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

}  // namespace tenter
