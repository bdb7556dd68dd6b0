// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/acquisition/frame_quality.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace tenter {
namespace {

constexpr int kSide_px = 200;

cv::Mat dots() {
  cv::Mat mat(kSide_px, kSide_px, CV_8UC1);
  cv::RNG random(7);
  random.fill(mat, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(mat, mat, {0, 0}, 2.0);
  cv::normalize(mat, mat, 40, 200, cv::NORM_MINMAX);
  return mat;
}

CameraImage imageOf(const cv::Mat& mat, int bits = 8) {
  CameraImage image;
  image.width_px = mat.cols;
  image.height_px = mat.rows;
  image.bits = bits;
  image.pixels.assign(mat.data, mat.data + mat.total() * mat.elemSize());
  return image;
}

TEST(FrameQuality, SharpnessFallsWithBlurAndHardlyWithAnythingElse) {
  const cv::Mat sharp = dots();
  const double reference = frameQuality(imageOf(sharp)).sharpness;
  cv::Mat blurred, dark, noisy(sharp.size(), CV_8UC1);
  cv::GaussianBlur(sharp, blurred, {0, 0}, 3.0);
  EXPECT_LT(frameQuality(imageOf(blurred)).sharpness, 0.5 * reference);
  sharp.convertTo(dark, CV_8U, 0.4, 10.0);
  EXPECT_NEAR(frameQuality(imageOf(dark)).sharpness, reference, 0.03 * reference);
  cv::Mat noise(sharp.size(), CV_16SC1), sum;
  cv::RNG random(9);
  random.fill(noise, cv::RNG::NORMAL, 0, 2.0);
  sharp.convertTo(sum, CV_16S);
  sum += noise;
  sum.convertTo(noisy, CV_8U);
  EXPECT_NEAR(frameQuality(imageOf(noisy)).sharpness, reference, 0.1 * reference);
}

TEST(FrameQuality, CountsPixelsAtTheEndOfTheScale) {
  cv::Mat mat = dots();
  mat.rowRange(0, 50) = 255;
  const FrameQuality quality = frameQuality(imageOf(mat));
  EXPECT_DOUBLE_EQ(quality.saturated_share, 0.25);
  cv::Mat deep;
  mat.convertTo(deep, CV_16U, 16.0);
  deep.rowRange(0, 50) = 4095;
  EXPECT_DOUBLE_EQ(frameQuality(imageOf(deep, 12)).saturated_share, 0.25);
}

TEST(FrameQuality, AnImageWithoutAnythingHasNoSharpness) {
  EXPECT_EQ(frameQuality(imageOf(cv::Mat(kSide_px, kSide_px, CV_8UC1, cv::Scalar(0)))).sharpness,
            0.0);
  EXPECT_EQ(frameQuality(CameraImage()).sharpness, 0.0);
}

TEST(EncodePng, LosesNothing) {
  const cv::Mat eight = dots();
  cv::Mat twelve;
  eight.convertTo(twelve, CV_16U, 13.0);
  for (const auto& [mat, bits] : {std::pair(eight, 8), std::pair(twelve, 12)}) {
    const auto png = encodePng(imageOf(mat, bits));
    ASSERT_TRUE(png) << png.error().message();
    const cv::Mat back =
        cv::imdecode(std::vector<char>(png->begin(), png->end()), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(back.type(), mat.type());
    EXPECT_EQ(cv::countNonZero(back != mat), 0);
  }
}

TEST(EncodePng, RefusesWhatIsNoImage) { EXPECT_FALSE(encodePng(CameraImage()).ok()); }

}  // namespace
}  // namespace tenter
