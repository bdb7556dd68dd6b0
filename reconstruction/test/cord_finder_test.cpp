// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/cord_finder.h"

#include <gtest/gtest.h>

#include "wrinkled_sheet.h"

namespace tenter::reconstruction_test {
namespace {

constexpr double kDiameter_m = 1e-3;

/// A bright stripe of a cord's width along its projection, over a dark ground, with soft edges.
GrayImage photographCord(const CameraView& view, const Vec3& from, const Vec3& to, unsigned seed) {
  GrayImage image(view.model.widthPx(), view.model.heightPx());
  const double half_px =
      0.5 * kDiameter_m * view.model.lens().fx_px / (view.camera_from_space * from).z();
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      image.at(x, y) = 50.0F;
      const Vec3 ray = *view.direction(Vec2(x, y)), line = (to - from).normalized();
      const Vec3 off = from - view.centre();
      const double b = ray.dot(line), d = ray.dot(off), e = line.dot(off);
      const double t = (b * d - e) / (1.0 - b * b);
      if (t < 0.0 || t > (to - from).norm()) continue;
      const double distance = (*view.project(from + t * line) - Vec2(x, y)).norm();
      const double share = std::clamp(0.5 + half_px - distance, 0.0, 1.0);
      image.at(x, y) = static_cast<float>(50.0 + 120.0 * share);
    }
  }
  return photographed(std::move(image), 2.0, seed);
}

TEST(CordFinder, FindsADirectionToATwentiethOfADegree) {
  const auto views = fourCameras();
  const Vec3 from(0.02, 0.03, 0.0), to(0.09, 0.08, 0.02);
  std::vector<GrayImage> images;
  for (unsigned v = 0; v < views.size(); ++v)
    images.push_back(photographCord(views[v], from, to, 60 + v));
  const CordGuess guess{from + Vec3(4e-4, 0.0, 0.0), to + Vec3(-1e-3, 1.5e-3, 1e-3), kDiameter_m};
  const auto found = findCord(views, images, guess);
  ASSERT_TRUE(found);
  const double error = std::acos(std::min(1.0, found->direction.dot((to - from).normalized())));
  EXPECT_EQ(found->views, 4);
  EXPECT_LT(error, 0.05 * std::numbers::pi / 180.0);
  EXPECT_LT(error, 4.0 * std::sqrt(2.0) * found->angle_sigma_rad);
  const Vec3 off = found->point_m - from;
  const Vec3 across = off - off.dot(found->direction) * found->direction;
  EXPECT_LT(across.norm(), 0.05e-3);
}

TEST(CordFinder, FindsNothingWhereThereIsNoCord) {
  const auto views = fourCameras();
  std::vector<GrayImage> images;
  for (unsigned v = 0; v < views.size(); ++v) {
    GrayImage image(views[v].model.widthPx(), views[v].model.heightPx());
    std::fill(image.pixels.begin(), image.pixels.end(), 50.0F);
    images.push_back(photographed(std::move(image), 2.0, 70 + v));
  }
  EXPECT_FALSE(findCord(views, images, {{0.02, 0.03, 0.0}, {0.09, 0.08, 0.02}, kDiameter_m}));
}

TEST(CordFinder, OneViewIsNotEnough) {
  const auto views = fourCameras();
  const Vec3 from(0.02, 0.03, 0.0), to(0.09, 0.08, 0.02);
  std::vector<GrayImage> images(views.size());
  images[1] = photographCord(views[1], from, to, 61);
  EXPECT_FALSE(findCord(views, images, {from, to, kDiameter_m}));
}

}  // namespace
}  // namespace tenter::reconstruction_test
