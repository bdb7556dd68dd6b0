// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tenter/calib/board_detector.h"
#include "tenter/calib/camera_calibration.h"

namespace tenter {

/// A camera and the images of the board that it took.
struct BoardPhoto {
  std::string file;
  int index = 0;  ///< Photos of all cameras with one index show the board in one pose.
  BoardCorners corners;
};
struct CameraPhotos {
  std::string name;
  int width_px = 0, height_px = 0;
  std::vector<BoardPhoto> photos;
  std::vector<RejectedImage> rejected;  ///< Images in which the board was not found.
};

/// A camera as a user names it: `token` stands for {camera} in the pattern.
struct CameraSource {
  std::string name, token;
};

/// Reads the images of all cameras and looks for the board in each. What cannot be read, has
/// another size than most, or does not show the board goes to `rejected`. Error if the pattern is
/// wrong, a camera has no image at all, or the board in the images has other counts than `board`.
/// @param progress  called before each image with the fraction done and its name; false stops.
Result<std::vector<CameraPhotos>> gatherPhotos(
    const std::string& pattern, const std::vector<CameraSource>& cameras, const Board& board,
    const std::function<bool(double, const std::string&)>& progress);

struct CameraCalibrationOptions {
  double max_rms_px = 0.5;  ///< Reprojection and held-out errors above it reject the calibration.
  bool fit_warp = true;     ///< With six sets or more.
  std::optional<int>
      rig_index;  ///< Photos with this index show the board lying in the rig's plane.
};

/// Fits lenses, poses of cameras and boards, and the board's warp to all photos together
/// (docs/calibration.md), leaves out photos that do not go with the rest, and judges the outcome. A
/// rejected calibration is returned with its reasons. Error, of kind kCalibrationRejected, only if
/// there is nothing to return: a camera with fewer than three usable photos, or one that shares no
/// set with the others; `left_out`, if given, then still tells which photos were not used and why,
/// by camera.
/// Precondition: a valid board, one or more cameras with distinct names.
Result<CameraCalibration> calibrateCameras(
    const Board& board, const std::vector<CameraPhotos>& cameras,
    const CameraCalibrationOptions& options,
    std::vector<std::vector<RejectedImage>>* left_out = nullptr);

}  // namespace tenter
