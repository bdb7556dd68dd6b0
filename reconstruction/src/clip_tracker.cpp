// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/clip_tracker.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "tag_detector.h"
#include "tenter/core/cross_matrix.h"

namespace tenter {

namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

constexpr int kMaxIterations = 40, kPlainIterations = 8;
constexpr double kSmallStep = 1e-10;
/// Corners farther than this from the projection count less, and in the end not at all [px].
constexpr double kLoss_px = 0.3, kStray_px = 1.5;
/// A clip whose corners disagree by more is not believed [px RMS].
constexpr double kLargestResidual_px = 1.0;
constexpr std::size_t kLeastCorners = 8;

/// The pose after a small turn about `pivot` and a displacement.
Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, const Vec6& step, const Vec3& pivot) {
  const double angle = step.head<3>().norm();
  const Eigen::AngleAxisd turn(angle,
                               angle > 0.0 ? Vec3(step.head<3>() / angle) : Vec3(Vec3::UnitX()));
  Eigen::Isometry3d result =
      Eigen::Translation3d(pivot + step.tail<3>()) * turn * Eigen::Translation3d(-pivot) * pose;
  result.linear() = Eigen::Quaterniond(result.linear()).normalized().toRotationMatrix();
  return result;
}

std::array<Vec3, 4> cornersOf(const ClipTag& tag) {
  const double half = 0.5 * tag.size_m;
  std::array<Vec3, 4> corners = {Vec3(-half, -half, 0.0), Vec3(half, -half, 0.0),
                                 Vec3(half, half, 0.0), Vec3(-half, half, 0.0)};
  for (Vec3& corner : corners) corner = tag.clip_from_tag * corner;
  return corners;
}

}  // namespace

ClipTracker::ClipTracker(std::vector<CameraView> views, std::vector<MountedClip> clips)
    : views_(std::move(views)), clips_(std::move(clips)) {
  for (const MountedClip& clip : clips_) {
    for (const ClipTag& tag : clip.tags) families_.insert(tag.family);
  }
}

std::optional<ClipPose> ClipTracker::fit(std::vector<Corner> corners,
                                         const Eigen::Isometry3d& start) const {
  ClipPose result;
  result.rig_from_clip = start;
  Vec3 middle = Vec3::Zero();
  for (const Corner& corner : corners)
    middle += corner.point_m / static_cast<double>(corners.size());
  for (int pass = 0; pass < 2; ++pass) {
    if (corners.size() < kLeastCorners) return std::nullopt;
    Mat6 normal;
    double squares = 0.0, chi2 = 0.0;
    for (int i = 0; i < kMaxIterations; ++i) {
      normal.setZero();
      Vec6 gradient = Vec6::Zero();
      squares = chi2 = 0.0;
      const Vec3 pivot = result.rig_from_clip * middle;
      for (const Corner& corner : corners) {
        const Vec3 at = result.rig_from_clip * corner.point_m;
        Eigen::Matrix<double, 2, 3> by_point;
        const auto pixel = views_[corner.view].project(at, &by_point);
        if (!pixel) return std::nullopt;
        Eigen::Matrix<double, 2, 6> jacobian;
        jacobian << by_point * -crossMatrix(at - pivot), by_point;
        const Vec2 residual = corner.pixel - *pixel;
        const double variance = corner.sigma_px * corner.sigma_px;
        // Cauchy's loss while strays are still among them, once the pose is near.
        const bool robust = pass == 0 && i >= kPlainIterations;
        const double loss =
            robust ? 1.0 / (1.0 + residual.squaredNorm() / (kLoss_px * kLoss_px)) : 1.0;
        normal += loss / variance * jacobian.transpose() * jacobian;
        gradient += loss / variance * jacobian.transpose() * residual;
        squares += residual.squaredNorm();
        chi2 += residual.squaredNorm() / variance;
      }
      const Vec6 step = normal.ldlt().solve(gradient);
      if (!step.allFinite()) return std::nullopt;
      result.rig_from_clip = moved(result.rig_from_clip, step, pivot);
      if (step.norm() < kSmallStep && (pass == 1 || i > kPlainIterations)) break;
    }
    const auto count = static_cast<double>(corners.size());
    result.residual_px = std::sqrt(squares / count);
    if (pass == 0) {
      std::erase_if(corners, [&](const Corner& corner) {
        const auto pixel = views_[corner.view].project(result.rig_from_clip * corner.point_m);
        return !pixel || (*pixel - corner.pixel).norm() > kStray_px;
      });
      continue;
    }
    if (result.residual_px > kLargestResidual_px) return std::nullopt;
    // Sigmas of corners are stated by their edges; what they fall short of their residuals counts.
    const double scale = std::max(1.0, chi2 / (2.0 * count - 6.0));
    const Mat6 covariance = scale * normal.ldlt().solve(Mat6::Identity());
    result.rotation_sigma_rad = std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3.0);
    result.position_sigma_m = std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3.0);
  }
  std::set<int> views;
  std::set<std::pair<int, int>> tags;
  for (const Corner& corner : corners) {
    views.insert(corner.view);
    tags.emplace(corner.view, corner.tag);
  }
  result.views = static_cast<int>(views.size());
  result.tags = static_cast<int>(tags.size());
  if (result.views < 2) return std::nullopt;
  return result;
}

Result<std::vector<std::optional<ClipPose>>> ClipTracker::find(
    const std::vector<GrayImage>& images, const std::vector<Eigen::Isometry3d>& last) const {
  std::vector<std::vector<SeenTag>> seen(views_.size());
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (images[v].width == 0 || families_.empty()) continue;
    auto tags = findTags(images[v], families_);
    if (!tags) return tags.error();
    seen[v] = std::move(*tags);
  }
  std::vector<std::optional<ClipPose>> poses;
  for (std::size_t c = 0; c < clips_.size(); ++c) {
    std::vector<Corner> corners;
    for (const ClipTag& tag : clips_[c].tags) {
      const auto points = cornersOf(tag);
      for (std::size_t v = 0; v < views_.size(); ++v) {
        for (const SeenTag& found : seen[v]) {
          if (found.family != tag.family || found.id != tag.id) continue;
          for (std::size_t k = 0; k < 4; ++k) {
            corners.push_back(
                {static_cast<int>(v), points[k], found.corners[k], found.sigma_px, tag.id});
          }
        }
      }
    }
    poses.push_back(fit(std::move(corners), last[c]));
  }
  return poses;
}

}  // namespace tenter
