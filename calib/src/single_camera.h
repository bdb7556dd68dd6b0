// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "bundle.h"
#include "tenter/calib/calibrate_cameras.h"

namespace tenter {

/// A photo that was left out, by its place in CameraPhotos::photos, and why.
using LeftOut = std::vector<std::pair<std::size_t, std::string>>;

/// One camera calibrated alone.
struct SingleCamera {
  LensVector lens = LensVector::Zero();
  double rms_px = 0.0;
  std::vector<std::size_t> photos;                   ///< The good ones, ascending.
  std::vector<Eigen::Isometry3d> camera_from_board;  ///< Of each good photo.
  LeftOut left_out;
};

/// Least number of photos that a camera needs.
inline constexpr std::size_t kMinPhotos = 3;

/// Error (place: the camera's name; kCalibrationRejected) if fewer than kMinPhotos are usable;
/// `left_out` is then what had been found so far.
Result<SingleCamera> calibrateAlone(const Board& board, const CameraPhotos& camera,
                                    LeftOut& left_out);

/// Images of a bundle whose error is out of proportion to that of the median image.
std::vector<std::size_t> outlyingImages(const Bundle& bundle);
/// "its corners miss the model by 1.23 px RMS, the median image's by 0.18 px".
std::string describeMisfit(const Bundle& bundle, const BundleImage& image);

}  // namespace tenter
