// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/clip_tracker.h"

#include <gtest/gtest.h>

#include <opencv2/aruco.hpp>

#include "wrinkled_sheet.h"

namespace tenter::reconstruction_test {
namespace {

constexpr double kTag_m = 0.012;
constexpr int kCells = 8;  ///< Of a tag with its border.
constexpr int kRays = 4;   ///< A pixel and side.

MountedClip barWithTags() {
  MountedClip clip;
  clip.id = "bar";
  for (int k = 0; k < 3; ++k) {
    ClipTag tag;
    tag.family = "apriltag_36h11";
    tag.id = k + 4;
    tag.size_m = kTag_m;
    tag.clip_from_tag.linear() = Vec3(1.0, -1.0, -1.0).asDiagonal();
    tag.clip_from_tag.translation() = Vec3(0.02 + 0.03 * k, 0.05, 0.002);
    clip.tags.push_back(tag);
  }
  return clip;
}

/// Grey level of a point of the plane of a tag: print on white.
double printAt(const cv::Mat& cells, const Vec2& place) {
  const Vec2 cell = (place / kTag_m + Vec2::Constant(0.5)) * kCells;
  if (cell.minCoeff() < -1.0 || cell.maxCoeff() > kCells + 1.0) return 60.0;
  if (cell.minCoeff() < 0.0 || cell.maxCoeff() >= kCells) return 210.0;
  return cells.at<uchar>(static_cast<int>(cell.y()), static_cast<int>(cell.x())) > 127 ? 210.0
                                                                                       : 25.0;
}

GrayImage photographTags(const CameraView& view, const MountedClip& clip,
                         const Eigen::Isometry3d& rig_from_clip, unsigned seed) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  GrayImage image(view.model.widthPx(), view.model.heightPx());
  std::fill(image.pixels.begin(), image.pixels.end(), 60.0F);
  for (const ClipTag& tag : clip.tags) {
    cv::Mat cells;
    cv::aruco::drawMarker(dictionary, tag.id, kCells, cells, 1);
    const Eigen::Isometry3d tag_from_space = (rig_from_clip * tag.clip_from_tag).inverse();
    const Vec3 from = tag_from_space * view.centre();
    const Vec2 middle = *view.project(rig_from_clip * tag.clip_from_tag.translation());
    const int reach = static_cast<int>(1.2 * kTag_m * view.model.lens().fx_px / 0.5);
    for (int y = std::max(0, int(middle.y()) - reach);
         y < std::min(image.height, int(middle.y()) + reach); ++y) {
      for (int x = std::max(0, int(middle.x()) - reach);
           x < std::min(image.width, int(middle.x()) + reach); ++x) {
        double sum = 0.0;
        for (int j = 0; j < kRays; ++j) {
          for (int i = 0; i < kRays; ++i) {
            const Vec2 pixel(x - 0.5 + (i + 0.5) / kRays, y - 0.5 + (j + 0.5) / kRays);
            const Vec3 ray = tag_from_space.linear() * *view.direction(pixel);
            sum += printAt(cells, (from - from.z() / ray.z() * ray).head<2>());
          }
        }
        if (sum != 60.0 * kRays * kRays) image.at(x, y) = static_cast<float>(sum / (kRays * kRays));
      }
    }
  }
  return photographed(std::move(image), 2.0, seed);
}

Eigen::Isometry3d somewhere() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(0.06, Vec3(0.5, 0.3, 1.0).normalized()).toRotationMatrix();
  pose.translation() = Vec3(0.004, -0.003, 0.002);
  return pose;
}

/// How far the pose is off, in the middle of the clip [m] and as a turn [rad].
std::pair<double, double> errorOf(const ClipPose& found, const Eigen::Isometry3d& truth) {
  const Vec3 middle(0.05, 0.05, 0.0);
  const Mat3 turn = found.rig_from_clip.linear() * truth.linear().transpose();
  return {(found.rig_from_clip * middle - truth * middle).norm(), Eigen::AngleAxisd(turn).angle()};
}

TEST(ClipTracker, FindsAClipToAHundredthOfAMillimetre) {
  const auto views = fourCameras(0.15e-3);
  const MountedClip clip = barWithTags();
  const Eigen::Isometry3d truth = somewhere();
  std::vector<GrayImage> images;
  for (unsigned v = 0; v < views.size(); ++v) {
    images.push_back(photographTags(views[v], clip, truth, 40 + v));
  }
  const ClipTracker tracker(views, {clip});
  const auto poses = tracker.find(images, {Eigen::Isometry3d::Identity()});
  ASSERT_TRUE(poses.ok());
  ASSERT_TRUE(poses->front());
  const ClipPose& found = *poses->front();
  const auto [distance_m, angle_rad] = errorOf(found, truth);
  EXPECT_EQ(found.tags, 12);
  EXPECT_LT(distance_m, 0.01e-3);
  EXPECT_LT(angle_rad, 3e-4);
  EXPECT_LT(distance_m, 4.0 * std::sqrt(3.0) * found.position_sigma_m + 1e-6);
  EXPECT_LT(found.residual_px, 0.1);
}

TEST(ClipTracker, AClipThatOneViewShowsIsNotFound) {
  const auto views = fourCameras(0.15e-3);
  const MountedClip clip = barWithTags();
  std::vector<GrayImage> images(views.size());
  images[0] = photographTags(views[0], clip, somewhere(), 50);
  const auto poses = ClipTracker(views, {clip}).find(images, {Eigen::Isometry3d::Identity()});
  ASSERT_TRUE(poses.ok());
  EXPECT_FALSE(poses->front());
}

TEST(ClipTracker, RefusesATagOfAnUnknownFamily) {
  const auto views = fourCameras();
  MountedClip clip = barWithTags();
  clip.tags.front().family = "runes";
  const std::vector<GrayImage> images(views.size(), GrayImage(64, 64));
  const auto poses = ClipTracker(views, {clip}).find(images, {Eigen::Isometry3d::Identity()});
  ASSERT_FALSE(poses.ok());
  EXPECT_NE(poses.error().message().find("runes"), std::string::npos);
}

}  // namespace
}  // namespace tenter::reconstruction_test
