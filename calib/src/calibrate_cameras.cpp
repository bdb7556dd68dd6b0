// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/calibrate_cameras.h"

#include <algorithm>
#include <cstdio>
#include <set>

#include "bundle.h"
#include "camera_graph.h"
#include "held_out.h"
#include "single_camera.h"
#include "tenter/calib/calibration_parameters.h"
#include "verdict.h"

namespace tenter {

namespace {

/// With fewer sets the warp of the board takes up what belongs to the lens.
constexpr std::size_t kSetsForWarp = 6;
constexpr double kFirstLossOfSide = 2e-3, kHuberSigmas = 3.0, kLeastLoss_px = 0.03;
constexpr int kMaxPasses = 6;

/// All there is while a calibration is made.
struct Work {
  const Board& board;
  const std::vector<CameraPhotos>& photos;
  const CameraCalibrationOptions& options;
  std::vector<SingleCamera> singles;
  std::vector<int> indices;  ///< Index of each set.
  Bundle bundle;
  std::vector<std::size_t> photo_of_image;  ///< Parallel to bundle.images.
  std::vector<LeftOut> left_out;            ///< By camera.
  BundleOptions fit;
};

Error rejection(const std::string& place, const std::string& reason, const std::string& advice) {
  Error error = badInput("", place, reason, advice);
  error.kind = ErrorKind::kCalibrationRejected;
  return error;
}

Result<void> calibrateEachAlone(Work& w) {
  Result<void> first_error;
  for (std::size_t i = 0; i < w.photos.size(); ++i) {
    auto single = calibrateAlone(w.board, w.photos[i], w.left_out[i]);
    if (!single && first_error.ok()) first_error = single.error();
    if (single) w.singles.push_back(std::move(*single));
  }
  return first_error;
}

int setOf(const Work& w, int index) {
  return static_cast<int>(std::lower_bound(w.indices.begin(), w.indices.end(), index) -
                          w.indices.begin());
}

Result<CameraPlacement> place(Work& w, const std::vector<BoardTurn>& turns) {
  std::set<int> indices;
  for (std::size_t camera = 0; camera < w.singles.size(); ++camera) {
    for (const std::size_t photo : w.singles[camera].photos) {
      indices.insert(w.photos[camera].photos[photo].index);
    }
  }
  w.indices.assign(indices.begin(), indices.end());
  BoardPoses poses(w.singles.size());
  for (std::size_t camera = 0; camera < w.singles.size(); ++camera) {
    const SingleCamera& single = w.singles[camera];
    for (std::size_t i = 0; i < single.photos.size(); ++i) {
      poses[camera][setOf(w, w.photos[camera].photos[single.photos[i]].index)] =
          single.camera_from_board[i];
    }
  }
  const auto placed = placeCameras(poses, turns);
  if (placed.ok()) return placed;
  const std::size_t lost = std::stoul(placed.error().place);
  return rejection(w.photos[lost].name, placed.error().reason,
                   "images with one index must show the board in one pose");
}

BoardCorners turned(const BoardCorners& corners, const BoardTurn& turn) {
  if (turn.id.empty() || corners.ids.size() != turn.id.size()) return corners;
  BoardCorners out = corners;
  for (std::size_t i = 0; i < turn.id.size(); ++i) {
    out.pixels.col(static_cast<Eigen::Index>(i)) = corners.pixels.col(turn.id[i]);
  }
  return out;
}

void assemble(Work& w, const CameraPlacement& placed, const std::vector<BoardTurn>& turns) {
  Bundle& bundle = w.bundle;
  bundle.board_m = w.board.cornerPositions();
  bundle.boards.assign(w.indices.size(), PoseVector::Zero());
  std::vector<std::size_t> corners_in(w.indices.size(), 0);
  for (std::size_t camera = 0; camera < w.singles.size(); ++camera) {
    const SingleCamera& single = w.singles[camera];
    bundle.lenses.push_back(single.lens);
    bundle.cameras.push_back(poseVector(placed.camera_from_world[camera]));
    for (std::size_t i = 0; i < single.photos.size(); ++i) {
      const BoardPhoto& photo = w.photos[camera].photos[single.photos[i]];
      const int set = setOf(w, photo.index);
      const BoardTurn& turn = turns[placed.turns[camera].at(set)];
      bundle.images.push_back({static_cast<int>(camera), set, turned(photo.corners, turn)});
      w.photo_of_image.push_back(single.photos[i]);
      // The camera that sees most of a board says where it is.
      if (photo.corners.ids.size() <= corners_in[set]) continue;
      corners_in[set] = photo.corners.ids.size();
      bundle.boards[set] = poseVector(placed.camera_from_world[camera].inverse() *
                                      single.camera_from_board[i] * turn.board_from_turned);
    }
  }
}

std::string disagreement(const Work& w, const BundleImage& image) {
  if (w.singles.size() == 1) return describeMisfit(w.bundle, image);
  char text[200];
  std::snprintf(text, sizeof text,
                "does not agree with the other cameras: %.2f px RMS with all, %.2f px with this "
                "camera alone; the board moved, or the image is of another set",
                rmsOf(w.bundle, image), w.singles[image.camera].rms_px);
  return text;
}

Result<void> fitTogether(Work& w) {
  w.fit.fit_warp = w.options.fit_warp && w.indices.size() >= kSetsForWarp;
  int side_px = 0;
  for (const CameraPhotos& camera : w.photos) {
    side_px = std::max({side_px, camera.width_px, camera.height_px});
  }
  double noise_px = 0.0;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    noise_px = solveRobustly(w.bundle, w.fit, kFirstLossOfSide * side_px);
    const std::vector<std::size_t> bad = outlyingImages(w.bundle);
    if (bad.empty()) break;
    for (const std::size_t i : bad) {
      const BundleImage& image = w.bundle.images[i];
      w.left_out[image.camera].emplace_back(w.photo_of_image[i], disagreement(w, image));
    }
    for (auto i = bad.rbegin(); i != bad.rend(); ++i) {
      w.bundle.images.erase(w.bundle.images.begin() + static_cast<std::ptrdiff_t>(*i));
      w.photo_of_image.erase(w.photo_of_image.begin() + static_cast<std::ptrdiff_t>(*i));
    }
    for (std::size_t camera = 0; camera < w.singles.size(); ++camera) {
      const auto left = std::count_if(
          w.bundle.images.begin(), w.bundle.images.end(),
          [&](const BundleImage& image) { return image.camera == static_cast<int>(camera); });
      if (left >= static_cast<std::ptrdiff_t>(kMinPhotos)) continue;
      return rejection(w.photos[camera].name,
                       "agrees with the other cameras in fewer than 3 images",
                       "images with one index must show the board in one pose");
    }
  }
  w.fit.loss_px = std::max(kLeastLoss_px, kHuberSigmas * noise_px);
  solveBundle(w.bundle, w.fit);
  return {};
}

std::vector<RejectedImage> rejectedOf(const CameraPhotos& camera, const LeftOut& left_out) {
  std::vector<RejectedImage> rejected = camera.rejected;
  for (const auto& [photo, reason] : left_out) {
    rejected.push_back({camera.photos[photo].file, reason});
  }
  std::sort(rejected.begin(), rejected.end(),
            [](const RejectedImage& a, const RejectedImage& b) { return a.image < b.image; });
  return rejected;
}

/// Set of the board that lies in the rig's plane; -1 if none does, or no usable image shows it.
int rigSet(const Work& w) {
  if (!w.options.rig_index) return -1;
  const auto found = std::find(w.indices.begin(), w.indices.end(), *w.options.rig_index);
  const int set = static_cast<int>(found - w.indices.begin());
  const bool used = std::any_of(w.bundle.images.begin(), w.bundle.images.end(),
                                [&](const BundleImage& image) { return image.set == set; });
  return found != w.indices.end() && used ? set : -1;
}

/// The board's z points into it, the rig's up; both x along the rows; origin in the board's middle.
Eigen::Isometry3d boardFromRig(const Bundle& bundle) {
  Eigen::Isometry3d board_from_rig = Eigen::Isometry3d::Identity();
  board_from_rig.linear() = Vec3(1.0, -1.0, -1.0).asDiagonal();
  board_from_rig.translation() = bundle.board_m.rowwise().mean();
  return board_from_rig;
}

/// The rig's origin moves with the board's corner, and when the board turns about that.
void moveToRigOrigin(const Bundle& bundle, int set, Eigen::MatrixXd& covariance) {
  const Vec3 arm = poseOf(bundle.boards[set]).linear() * Vec3(boardFromRig(bundle).translation());
  Eigen::MatrixXd change = Eigen::MatrixXd::Identity(covariance.rows(), covariance.cols());
  const Eigen::Index at = covariance.rows() - 6;
  for (int axis = 0; axis < 3; ++axis)
    change.block<3, 1>(at + 3, at + axis) = Vec3(Vec3::Unit(axis)).cross(arm);
  covariance = change * covariance * change.transpose();
}

void nameAllParameters(const Work& w, CameraCalibration& c) {
  for (std::size_t camera = 0; camera < w.photos.size(); ++camera) {
    nameParameters(w.photos[camera].name, kLensParameters, c.parameters);
    if (camera > 0) nameParameters(w.photos[camera].name, kPoseParameters, c.parameters);
  }
  if (w.fit.fit_warp) {
    c.parameters.emplace_back("board.warp_m[0]");
    c.parameters.emplace_back("board.warp_m[1]");
  }
  if (w.fit.rig_set >= 0) nameParameters(std::string(kRigPose), kPoseParameters, c.parameters);
}

void addUncertainty(Work& w, CameraCalibration& c) {
  w.fit.rig_set = rigSet(w);
  BundleCovariance covariance = bundleCovariance(w.bundle, w.fit);
  if (!covariance.observable) return;
  nameAllParameters(w, c);
  c.covariance = std::move(covariance.matrix);
  if (w.fit.rig_set >= 0) moveToRigOrigin(w.bundle, w.fit.rig_set, c.covariance);
  c.quality.noise_px = covariance.noise_px;
  const Eigen::VectorXd sigma = c.covariance.diagonal().cwiseSqrt();
  Eigen::Index at = 0;
  for (std::size_t camera = 0; camera < c.cameras.size(); ++camera) {
    c.cameras[camera].lens_sigma.assign(sigma.data() + at, sigma.data() + at + kLensTerms);
    at += kLensTerms;
    if (camera == 0) continue;
    c.cameras[camera].rotation_sigma_rad = sigma.segment<3>(at);
    c.cameras[camera].translation_sigma_m = sigma.segment<3>(at + 3);
    at += 6;
  }
  if (w.fit.fit_warp) c.warp_sigma_m = sigma.segment<2>(at);
}

bool isShared(const Bundle& bundle, const BundleImage& image) {
  return std::any_of(bundle.images.begin(), bundle.images.end(), [&](const BundleImage& other) {
    return other.set == image.set && other.camera != image.camera;
  });
}

Result<void> addRig(const Work& w, CameraCalibration& c) {
  if (!w.options.rig_index) return {};
  const int set = rigSet(w);
  if (set < 0) {
    return rejection("index " + std::to_string(*w.options.rig_index),
                     "no usable image shows the board that lies in the rig's plane", "");
  }
  const Eigen::Isometry3d world_from_rig = poseOf(w.bundle.boards[set]) * boardFromRig(w.bundle);
  c.rig = RigFrame{world_from_rig.inverse(), world_from_rig.linear() * kDefaultGravity};
  return {};
}

Result<CameraCalibration> summarise(Work& w) {
  CameraCalibration c;
  c.source = "tenter calibrate cameras";
  c.board = w.board;
  if (w.fit.fit_warp) c.warp_m = w.bundle.warp_m;
  for (std::size_t i = 0; i < w.photos.size(); ++i) {
    const auto model =
        CameraModel::make(w.photos[i].width_px, w.photos[i].height_px, lensOf(w.bundle.lenses[i]));
    if (!model) return rejection(w.photos[i].name, "the fit gives no camera", "");
    CalibratedCamera camera{w.photos[i].name, *model, poseOf(w.bundle.cameras[i])};
    camera.rms_px = rmsOf(
        w.bundle, [&](const BundleImage& image) { return image.camera == static_cast<int>(i); });
    camera.alone_rms_px = w.singles[i].rms_px;
    camera.rejected = rejectedOf(w.photos[i], w.left_out[i]);
    c.cameras.push_back(std::move(camera));
  }
  for (std::size_t i = 0; i < w.bundle.images.size(); ++i) {
    const BundleImage& image = w.bundle.images[i];
    const BoardPhoto& photo = w.photos[image.camera].photos[w.photo_of_image[i]];
    c.cameras[image.camera].used.push_back({photo.file, photo.index,
                                            static_cast<int>(image.corners.ids.size()),
                                            rmsOf(w.bundle, image)});
  }
  c.quality.rms_px = rmsOf(w.bundle, [](const BundleImage&) { return true; });
  if (w.photos.size() > 1) {
    c.quality.stereo_rms_px =
        rmsOf(w.bundle, [&](const BundleImage& image) { return isShared(w.bundle, image); });
  }
  addUncertainty(w, c);
  measureHeldOut(w.bundle, w.fit, c.quality);
  if (auto done = addRig(w, c); !done) return done.error();
  judge(w.photos, w.options, c);
  return c;
}

Result<CameraCalibration> calibrate(Work& w) {
  if (auto done = calibrateEachAlone(w); !done) return done.error();
  const std::vector<BoardTurn> turns = boardTurns(w.board);
  const auto placed = place(w, turns);
  if (!placed) return placed.error();
  assemble(w, *placed, turns);
  if (auto done = fitTogether(w); !done) return done.error();
  return summarise(w);
}

}  // namespace

Result<CameraCalibration> calibrateCameras(const Board& board,
                                           const std::vector<CameraPhotos>& cameras,
                                           const CameraCalibrationOptions& options,
                                           std::vector<std::vector<RejectedImage>>* left_out) {
  require(validateBoard(board).ok() && !cameras.empty(), "a valid board and a camera at least");
  Work work{board, cameras, options, {}, {}, {}, {}, {}, {}};
  work.left_out.resize(cameras.size());
  auto calibration = calibrate(work);
  if (left_out != nullptr) {
    left_out->clear();
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      left_out->push_back(rejectedOf(cameras[i], work.left_out[i]));
    }
  }
  return calibration;
}

}  // namespace tenter
