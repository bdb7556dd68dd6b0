// SPDX-License-Identifier: GPL-3.0-or-later
#include "single_camera.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <opencv2/calib3d.hpp>

namespace tenter {

namespace {

/// An image is left out when its RMS exceeds this many times the median image's ...
constexpr double kMisfitFactor = 3.0;
/// ... but not for less than this: images of a computer agree to rounding.
constexpr double kLeastMisfit_px = 0.1;
/// Width of the first, forgiving loss as a fraction of the image's longer side.
constexpr double kFirstLossOfSide = 2e-3;
constexpr int kMaxPasses = 6;

double medianRms(const Bundle& bundle) {
  std::vector<double> sizes;
  for (const BundleImage& image : bundle.images) sizes.push_back(rmsOf(bundle, image));
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle;
}

struct CvCorners {
  std::vector<cv::Point3f> board;
  std::vector<cv::Point2f> pixels;
};

CvCorners cvCorners(const Points3& board_m, const BoardCorners& corners) {
  CvCorners out;
  for (Eigen::Index i = 0; i < corners.pixels.cols(); ++i) {
    const Vec3 p = board_m.col(corners.ids[i]);
    out.board.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F);
    out.pixels.emplace_back(static_cast<float>(corners.pixels(0, i)),
                            static_cast<float>(corners.pixels(1, i)));
  }
  return out;
}

/// Pose of a flat board under a pinhole without distortion; false if there is none.
bool poseOfBoard(const CvCorners& corners, const LensVector& lens, PoseVector& pose) {
  const cv::Matx33d matrix(lens[0], 0, lens[2], 0, lens[1], lens[3], 0, 0, 1);
  cv::Vec3d rotation, translation;
  try {
    if (!cv::solvePnP(corners.board, corners.pixels, matrix, cv::noArray(), rotation, translation,
                      false, cv::SOLVEPNP_IPPE)) {
      return false;
    }
  } catch (const cv::Exception&) {
    return false;
  }
  for (int i = 0; i < 3; ++i) {
    pose[i] = rotation[i];
    pose[3 + i] = translation[i];
  }
  return pose.allFinite() && translation[2] > 0.0;
}

/// Focal lengths worth a try: what single images and all together say [Zha00], and a fixed series
/// for the case that all of them show the board head on.
std::vector<double> focalGuesses(const std::vector<CvCorners>& corners, const cv::Size& size) {
  std::vector<double> guesses;
  const auto add = [&](const std::vector<std::size_t>& which) {
    std::vector<std::vector<cv::Point3f>> board;
    std::vector<std::vector<cv::Point2f>> pixels;
    for (const std::size_t i : which) {
      board.push_back(corners[i].board);
      pixels.push_back(corners[i].pixels);
    }
    try {
      const double focal = cv::initCameraMatrix2D(board, pixels, size, 1.0).at<double>(0, 0);
      if (std::isfinite(focal) && focal > 0.2 * size.width && focal < 50.0 * size.width) {
        guesses.push_back(focal);
      }
    } catch (const cv::Exception&) {
      return;  // a degenerate set of images gives no guess
    }
  };
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    all.push_back(i);
    if (i < 12) add({i});
  }
  add(all);
  for (const double factor : {0.6, 1.0, 1.6, 2.5, 4.0, 7.0}) {
    guesses.push_back(factor * std::max(size.width, size.height));
  }
  return guesses;
}

/// Poses of all boards for one lens, and a robust measure of how well they fit.
double tryLens(const std::vector<CvCorners>& corners, const LensVector& lens, double cap_px,
               Bundle& bundle) {
  bundle.lenses[0] = lens;
  double cost = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    PoseVector pose;
    if (!poseOfBoard(corners[i], lens, pose)) {
      pose << 0, 0, 0, 0, 0, 1;
      cost += cap_px;
    }
    bundle.boards[i] = pose;
    cost += std::min(cap_px, rmsOf(bundle, bundle.images[i]));
  }
  return cost;
}

void initialise(const std::vector<CvCorners>& corners, const cv::Size& size, Bundle& bundle) {
  const double cap_px = 0.02 * std::max(size.width, size.height);
  double best = std::numeric_limits<double>::infinity();
  Bundle chosen = bundle;
  for (const double focal : focalGuesses(corners, size)) {
    LensVector lens = LensVector::Zero();
    lens.head<4>() << focal, focal, 0.5 * (size.width - 1), 0.5 * (size.height - 1);
    const double cost = tryLens(corners, lens, cap_px, bundle);
    if (cost < best) {
      best = cost;
      chosen = bundle;
    }
  }
  bundle = chosen;
}

}  // namespace

std::vector<std::size_t> outlyingImages(const Bundle& bundle) {
  std::vector<std::size_t> out;
  if (bundle.images.empty()) return out;
  const double limit = std::max(kLeastMisfit_px, kMisfitFactor * medianRms(bundle));
  for (std::size_t i = 0; i < bundle.images.size(); ++i) {
    if (!(rmsOf(bundle, bundle.images[i]) <= limit)) out.push_back(i);
  }
  return out;
}

std::string describeMisfit(const Bundle& bundle, const BundleImage& image) {
  char text[160];
  std::snprintf(text, sizeof text,
                "its corners miss the model by %.2f px RMS, those of the median image by %.2f px",
                rmsOf(bundle, image), medianRms(bundle));
  return text;
}

Result<SingleCamera> calibrateAlone(const Board& board, const CameraPhotos& camera,
                                    LeftOut& left_out) {
  Bundle bundle{board.cornerPositions(), {LensVector::Zero()}, {PoseVector::Zero()}, {}, {}, {}};
  bundle.warp_m.setZero();
  std::vector<CvCorners> corners;
  for (std::size_t i = 0; i < camera.photos.size(); ++i) {
    bundle.images.push_back({0, static_cast<int>(i), camera.photos[i].corners});
    corners.push_back(cvCorners(bundle.board_m, camera.photos[i].corners));
  }
  bundle.boards.assign(bundle.images.size(), PoseVector::Zero());
  const auto tooFew = [&](const std::string& reason) {
    Error error = badInput("", camera.name, reason, "take more images, the board tilted each time");
    error.kind = ErrorKind::kCalibrationRejected;
    return error;
  };
  const auto usable = [&] {
    return "has " + std::to_string(bundle.images.size()) +
           " usable images of the board; at least " + std::to_string(kMinPhotos) + " are needed";
  };
  if (bundle.images.size() < kMinPhotos) return tooFew(usable());
  initialise(corners, cv::Size(camera.width_px, camera.height_px), bundle);
  const double first_loss = kFirstLossOfSide * std::max(camera.width_px, camera.height_px);
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    solveRobustly(bundle, {}, first_loss);
    const std::vector<std::size_t> bad = outlyingImages(bundle);
    if (bad.empty()) break;
    const Bundle before = bundle;
    for (const std::size_t i : bad) {
      left_out.emplace_back(static_cast<std::size_t>(before.images[i].set),
                            describeMisfit(before, before.images[i]));
    }
    for (auto i = bad.rbegin(); i != bad.rend(); ++i) {
      bundle.images.erase(bundle.images.begin() + static_cast<std::ptrdiff_t>(*i));
    }
    if (bundle.images.size() < kMinPhotos) return tooFew(usable());
  }
  SingleCamera out;
  out.lens = bundle.lenses[0];
  out.rms_px = rmsOf(bundle, [](const BundleImage&) { return true; });
  for (const BundleImage& image : bundle.images) {
    out.photos.push_back(static_cast<std::size_t>(image.set));
    out.camera_from_board.push_back(poseOf(bundle.boards[image.set]));
  }
  out.left_out = left_out;
  return out;
}

}  // namespace tenter
