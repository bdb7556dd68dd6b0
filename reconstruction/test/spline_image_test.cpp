// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/spline_image.h"

#include <gtest/gtest.h>

#include <random>

#include "speckle.h"

namespace tenter::reconstruction_test {
namespace {

constexpr int kWidth = 61, kHeight = 47;
/// Single precision on 255 grey levels, through two recursive filters.
constexpr double kRounding = 2e-3;

TEST(SplineImage, PassesThroughEveryPixelUpToTheBorder) {
  const GrayImage image = photographed(seen(SpeckleTexture(1), kWidth, kHeight), 5.0, 2);
  const SplineImage spline(image);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      ASSERT_NEAR(spline.value(x, y), image.at(x, y), kRounding) << x << ' ' << y;
    }
  }
}

TEST(SplineImage, ReproducesCubicsAwayFromTheBorder) {
  const auto cubic = [](double x, double y) {
    return 90.0 + 0.002 * (x - 30) * (x - 30) * (x - 30) + 0.05 * (y - 20) * (y - 20) + 0.3 * x;
  };
  GrayImage image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) image.at(x, y) = static_cast<float>(cubic(x, y));
  }
  const SplineImage spline(image);
  for (const Vec2& place : {Vec2(30.5, 20.25), Vec2(24.1, 22.9), Vec2(35.75, 18.5)}) {
    EXPECT_NEAR(spline.value(place.x(), place.y()), cubic(place.x(), place.y()), kRounding);
  }
}

TEST(SplineImage, SamplesManyPlacesAsOne) {
  const SplineImage spline(photographed(seen(SpeckleTexture(1), kWidth, kHeight), 5.0, 2));
  const std::vector<float> x = {100.25F, 150.0F, 103.999F}, y = {101.5F, 146.0F, 100.0F};
  std::vector<float> values(3);
  spline.sample(-100, -100, {x.data(), 2}, {y.data(), 2}, {values.data(), 2});
  EXPECT_NEAR(values[0], spline.value(0.25, 1.5), kRounding);
  EXPECT_NEAR(values[1], spline.value(50.0, 46.0), kRounding);
  EXPECT_EQ(values[2], 0.0F);
}

TEST(GradientImage, HasTheSmoothedDerivativesOfARamp) {
  GrayImage image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      image.at(x, y) = 2.0F * static_cast<float>(x) - static_cast<float>(y) + 60.0F;
  }
  const GradientImage gradients(image);
  EXPECT_NEAR(*gradients.slopesX(30, 20), 2.0, 1e-4);
  EXPECT_NEAR(*gradients.slopesY(30, 20), -1.0, 1e-4);
}

TEST(SmoothedNoiseGain, IsWhatInterpolatedNoiseHas) {
  constexpr int kSide = 400;
  GrayImage flat(kSide, kSide);
  for (float& pixel : flat.pixels) pixel = 100.0F;
  std::mt19937 random(5);
  std::normal_distribution<float> normal(0.0F, 10.0F);
  for (float& pixel : flat.pixels) pixel += normal(random);
  const SplineImage spline(flat);
  EXPECT_NEAR(smoothedNoiseGain(0.0), 1.0, 1e-3);
  EXPECT_NEAR(smoothedNoiseGain(0.3), smoothedNoiseGain(0.7), 1e-6);
  for (const double t : {0.2, 0.5}) {
    // Moved along x alone; smoothed in both directions.
    double squares = 0.0, count = 0.0;
    for (int y = 20; y < kSide - 20; y += 2) {
      for (int x = 20; x < kSide - 20; x += 2) {
        double smooth = 0.0;
        for (int j = -1; j <= 1; ++j) {
          for (int i = -1; i <= 1; ++i) {
            const double weight = (i == 0 ? 2.0 : 1.0) * (j == 0 ? 2.0 : 1.0) / 16.0;
            smooth += weight * static_cast<double>(spline.value(x + t + i, y + j) - 100.0F);
          }
        }
        squares += smooth * smooth;
        count += 1.0;
      }
    }
    const double whole = 100.0 * 0.375 * 0.375;
    // Four standard deviations of a variance from some 10^4 independent values.
    EXPECT_NEAR(squares / count / whole, smoothedNoiseGain(t), 0.05) << t;
  }
}

}  // namespace
}  // namespace tenter::reconstruction_test
