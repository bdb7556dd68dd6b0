// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/camera_model.h"

#include <gtest/gtest.h>

#include <limits>
#include <opencv2/calib3d.hpp>
#include <random>

namespace tenter {
namespace {

constexpr unsigned kSeed = 7;

Lens distorted() {
  return {1500.0, 1510.0, 655.5, 480.25, {-0.31, 0.12, 8e-4, -5e-4, -0.02, 0.05, 0.01, -0.004}};
}

CameraModel camera(const Lens& lens) { return *CameraModel::make(1280, 960, lens); }

Vec3 randomPoint(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  return {0.3 * unit(random), 0.25 * unit(random), 0.9 + 0.2 * unit(random)};
}

TEST(CameraModelTest, ProjectsAsOpenCvDoes) {
  const CameraModel model = camera(distorted());
  const Lens& lens = model.lens();
  const cv::Matx33d matrix(lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1);
  const std::vector<double> coefficients(lens.distortion.begin(), lens.distortion.end());
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 50; ++i) {
    const Vec3 point = randomPoint(random);
    std::vector<cv::Point2d> expected;
    cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}}, cv::Vec3d(),
                      cv::Vec3d(), matrix, coefficients, expected);
    const auto pixel = model.project(point);
    ASSERT_TRUE(pixel.has_value());
    EXPECT_NEAR(pixel->x(), expected[0].x, 1e-9);
    EXPECT_NEAR(pixel->y(), expected[0].y, 1e-9);
  }
}

TEST(CameraModelTest, JacobianIsThatOfTheProjection) {
  const CameraModel model = camera(distorted());
  std::mt19937_64 random(kSeed);
  constexpr double kStep = 1e-6, kTolerance = 1e-4;  // px/m, of entries of about 1500
  for (int i = 0; i < 20; ++i) {
    const Vec3 point = randomPoint(random);
    Eigen::Matrix<double, 2, 3> jacobian;
    const auto pixel = model.project(point, &jacobian);
    ASSERT_TRUE(pixel.has_value());
    EXPECT_NEAR((*pixel - *model.project(point)).norm(), 0.0, 1e-10);
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 step = kStep * Vec3::Unit(axis);
      const Vec2 slope =
          (*model.project(point + step) - *model.project(point - step)) / (2.0 * kStep);
      EXPECT_NEAR((slope - jacobian.col(axis)).norm(), 0.0, kTolerance);
    }
  }
}

TEST(CameraModelTest, NormalizedUndoesTheLensOverTheWholeImage) {
  const CameraModel model = camera(distorted());
  for (int x = 0; x < 1280; x += 60) {
    for (int y = 0; y < 960; y += 60) {
      const Vec2 pixel(x, y);
      const auto direction = model.normalized(pixel);
      ASSERT_TRUE(direction.has_value()) << x << " " << y;
      const auto back = model.project(direction->homogeneous());
      ASSERT_TRUE(back.has_value());
      EXPECT_NEAR((*back - pixel).norm(), 0.0, 1e-8);
    }
  }
}

TEST(CameraModelTest, SeesNothingBehindItAndNothingBeyondTheFold) {
  Lens lens = distorted();
  EXPECT_FALSE(camera(lens).project({0.0, 0.0, -1.0}).has_value());
  EXPECT_FALSE(camera(lens).project({0.0, 0.0, 0.0}).has_value());
  // r (1 - r^2) turns back at r = 1 / sqrt(3), where it is 0.385.
  lens.distortion = {-1.0, 0, 0, 0, 0, 0, 0, 0};
  const CameraModel folding = camera(lens);
  EXPECT_NEAR(folding.radiusLimit(), 1.0 / std::sqrt(3.0), 2e-3);
  EXPECT_TRUE(folding.project({0.55, 0.0, 1.0}).has_value());
  EXPECT_FALSE(folding.project({0.95, 0.0, 1.0}).has_value());
  EXPECT_FALSE(folding.normalized({lens.cx_px + 0.5 * lens.fx_px, lens.cy_px}).has_value());
  EXPECT_FALSE(folding.normalized({std::numeric_limits<double>::infinity(), 0.0}).has_value());
}

TEST(CameraModelTest, RefusesNumbersThatAreNoCamera) {
  const auto place = [](int width, int height, const Lens& lens) {
    const auto model = CameraModel::make(width, height, lens);
    return model.ok() ? "" : model.error().place;
  };
  EXPECT_EQ(place(1280, 960, distorted()), "");
  EXPECT_EQ(place(0, 960, distorted()), "width_px");
  EXPECT_EQ(place(1280, 100000, distorted()), "height_px");
  Lens lens = distorted();
  lens.fx_px = -lens.fx_px;
  EXPECT_EQ(place(1280, 960, lens), "fx_px");
  lens = distorted();
  lens.fy_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(place(1280, 960, lens), "fy_px");
  lens = distorted();
  lens.cx_px = 1e9;
  EXPECT_EQ(place(1280, 960, lens), "cx_px");
  lens = distorted();
  lens.distortion[3] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(place(1280, 960, lens), "distortion");
}

}  // namespace
}  // namespace tenter
