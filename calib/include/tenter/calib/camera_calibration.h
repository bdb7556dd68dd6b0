// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/calib/board.h"
#include "tenter/calib/camera_model.h"

namespace tenter {

inline constexpr int kCalibrationSchemaVersion = 1;
/// Name of the rig's pose among a covariance's parameters: world_from_rig = [exp(rotation) R | t +
/// translation].
inline constexpr std::string_view kRigPose = "rig";

/// An image that a calibration did not use, and why.
struct RejectedImage {
  std::string image, reason;
};

/// An image that it used.
struct UsedImage {
  std::string image;
  int index = 0;    ///< Its number; images of one number show the board in one pose.
  int corners = 0;  ///< How many of the board's corners it shows.
  double rms_px = 0.0;
};

/// One camera: its lens, its place, and how well they are known.
struct CalibratedCamera {
  std::string name;
  CameraModel model;
  /// Takes points of the calibration's world to the camera's frame. The world is the first
  /// camera's frame; `RigFrame` leads from there to the rig.
  Eigen::Isometry3d camera_from_world = Eigen::Isometry3d::Identity();

  /// One standard deviation of fx, fy, cx, cy [px], k1, k2, p1, p2, k3; empty if not known.
  std::vector<double> lens_sigma = {};
  /// Of the camera's pose, in its own frame; zero for the first camera and if not known.
  Vec3 rotation_sigma_rad = Vec3::Zero(), translation_sigma_m = Vec3::Zero();

  /// Root mean square distance of corners from the model, all accepted images, all cameras fitted
  /// together; and with this camera's lens fitted alone.
  std::optional<double> rms_px = {}, alone_rms_px = {};
  std::vector<UsedImage> used = {};
  std::vector<RejectedImage> rejected = {};
};

/// What the calibration is worth. Absent: not measured (imported, or too few images).
struct CalibrationQuality {
  std::optional<double> rms_px;         ///< Over all cameras.
  std::optional<double> stereo_rms_px;  ///< Over the sets that more than one camera shows.
  std::optional<double> noise_px;       ///< Standard deviation of a corner's coordinate.
  /// Boards that the fit had not seen, five folds: only their poses are fitted.
  std::optional<double> held_out_rms_px;
  std::optional<double> epipolar_rms_px;  ///< Their corners' distance from epipolar lines.
  /// Their triangulated corners: error of known distances of about half the board.
  std::optional<double> distance_rms_m, distance_max_m;
};

/// Where the rig is, if a board lay in its plane: docs/conventions.md.
struct RigFrame {
  Eigen::Isometry3d rig_from_world = Eigen::Isometry3d::Identity();
  Vec3 gravity_world_m_per_s2 = Vec3::Zero();
};

/// The content of a camera calibration file, docs/formats/camera-calibration.md.
struct CameraCalibration {
  std::string source;  ///< "tenter calibrate cameras", "OpenCV", "DICe".
  bool accepted = true;
  std::vector<std::string> reasons;   ///< Why it was rejected.
  std::vector<std::string> warnings;  ///< What a person should know.
  std::optional<Board> board;
  std::optional<Vec2> warp_m,
      warp_sigma_m;  ///< Middle over rim along x and y, docs/calibration.md.
  std::vector<CalibratedCamera> cameras;
  CalibrationQuality quality;
  std::optional<RigFrame> rig;

  /// Joint covariance, symmetric, and the name of each row: "left.fx_px", "right.rotation_rad[0]",
  /// "board.warp_m[1]", "rig.rotation_rad[2]". Empty if not known.
  std::vector<std::string> parameters;
  Eigen::MatrixXd covariance;

  const CalibratedCamera* find(const std::string& name) const;
};

/// Distance of two cameras' centres of projection [m].
double baseline_m(const CalibratedCamera& a, const CalibratedCamera& b);

/// The text of a calibration file. Precondition: at least one camera, names distinct.
std::string calibrationText(const CameraCalibration& c);

/// Writes it, complete or absent.
Result<void> writeCalibration(const std::filesystem::path& file, const CameraCalibration& c);

/// Reads and checks. A calibration whose verdict is "rejected" is an error of kind
/// kCalibrationRejected unless `also_rejected`.
Result<CameraCalibration> readCalibration(const std::filesystem::path& file,
                                          bool also_rejected = false);

}  // namespace tenter
