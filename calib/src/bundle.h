// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "tenter/calib/board.h"
#include "tenter/calib/board_detector.h"
#include "tenter/calib/camera_model.h"

namespace tenter {

/// A pose as the solver moves it: rotation vector [rad], translation [m].
using PoseVector = Eigen::Matrix<double, 6, 1>;
PoseVector poseVector(const Eigen::Isometry3d& pose);
Eigen::Isometry3d poseOf(const PoseVector& vector);

/// What calibration fits of a lens: fx fy cx cy [px], k1 k2 p1 p2 k3.
inline constexpr int kLensTerms = 9;
using LensVector = Eigen::Matrix<double, kLensTerms, 1>;
Lens lensOf(const LensVector& vector);

/// One image of the board by one camera.
struct BundleImage {
  int camera = 0, set = 0;  ///< Images of one set show the board in one pose.
  BoardCorners corners;
};

/// Cameras, boards, and the images that tie them together [TMHF99]. The world is the frame of
/// camera 0. Warp is the height of the board's middle over its rim along x and along y [m]:
/// z = w_x (1 - a^2) + w_y (1 - b^2), a and b from -1 to 1 across the corners
/// (docs/calibration.md).
struct Bundle {
  Points3 board_m;  ///< Flat corners, 3 x n.
  std::vector<LensVector> lenses;
  std::vector<PoseVector> cameras;  ///< camera_from_world.
  std::vector<PoseVector> boards;   ///< world_from_board, by set.
  Vec2 warp_m = Vec2::Zero();
  std::vector<BundleImage> images;

  /// Corners of the warped board in its frame, 3 x n [m].
  Points3 warpedBoard() const;
  /// Predicted minus seen, 2 x corners [px]; NaN where a corner falls behind the camera.
  Points2 residuals(const BundleImage& image) const;
};

struct BundleOptions {
  double loss_px = 0.0;  ///< Where the Huber loss turns linear (Cauchy with `heavy`); 0: squares.
  bool heavy = false;    ///< Cauchy's loss, for data with outliers still in it.
  bool fit_lenses = true, fit_cameras = true, fit_warp = false;
  int max_iterations = 100;
  int rig_set = -1;  ///< Set whose board's pose the covariance holds too; -1: none.
};

/// Minimises over the poses of all boards that images show, and what the options free. Writes the
/// best found into `bundle` and says whether it converged.
bool solveBundle(Bundle& bundle, const BundleOptions& options);

/// The same after a rough start: wide Cauchy loss first, then narrower as the noise shows. Returns
/// the standard deviation of a coordinate of the good corners [px] (from the median, Gaussian).
double solveRobustly(Bundle& bundle, const BundleOptions& options, double first_loss_px);

/// Root mean square distance of an image's corners from the model [px]; infinite if any falls
/// behind.
double rmsOf(const Bundle& bundle, const BundleImage& image);
/// Over the corners of all images for which `wanted` holds; 0 if there are none.
double rmsOf(const Bundle& bundle, const std::function<bool(const BundleImage&)>& wanted);

/// Covariance of cameras, warp and the rig's board at an optimum, other boards integrated out.
struct BundleCovariance {
  /// Per camera: kLensTerms of its lens, then, but for camera 0, its pose: small rotation [rad] and
  /// displacement [m] in the camera's frame (camera_from_world = [exp(rotation) R | t +
  /// displacement]). Then the warp, if fitted, and the pose of the board of `rig_set`, in the
  /// world.
  Eigen::MatrixXd matrix;
  double noise_px =
      0.0;  ///< Standard deviation of a coordinate: sqrt(sum r^2 / (2 n - parameters)).
  bool observable =
      true;  ///< False if some direction is not seen at all; the matrix is then empty.
};
BundleCovariance bundleCovariance(Bundle& bundle, const BundleOptions& options);

}  // namespace tenter
