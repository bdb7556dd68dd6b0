// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/triangulate.h"

#include <gtest/gtest.h>

#include "wrinkled_sheet.h"

namespace tenter::reconstruction_test {
namespace {

std::vector<Sighting> sightingsOf(const std::vector<CameraView>& views, const Vec3& point,
                                  double noise_px, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, noise_px);
  std::vector<Sighting> sightings;
  for (int v = 0; v < static_cast<int>(views.size()); ++v) {
    const Vec2 pixel = *views[v].project(point) + Vec2(noise(random), noise(random));
    sightings.push_back({v, pixel, std::max(noise_px * noise_px, 1e-6) * Mat2::Identity()});
  }
  return sightings;
}

TEST(Triangulate, FindsAPointThroughLensesExactly) {
  const auto views = fourCameras();
  std::mt19937 random(1);
  const Vec3 point(0.08, 0.03, 0.004);
  const auto found = triangulate(views, sightingsOf(views, point, 0.0, random));
  ASSERT_TRUE(found);
  EXPECT_LT((found->position_m - point).norm(), 1e-9);
  EXPECT_LT(found->residual_px, 1e-6);
}

TEST(Triangulate, ErrsByWhatItsCovarianceSays) {
  const auto views = fourCameras();
  std::mt19937 random(2);
  constexpr int kTrials = 2000;
  constexpr double kNoise_px = 0.05;
  double distance2 = 0.0, chi2 = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    const Vec3 point(0.02 + 3e-5 * i, 0.05, 0.002);
    const auto found = triangulate(views, sightingsOf(views, point, kNoise_px, random));
    ASSERT_TRUE(found);
    const Vec3 error = found->position_m - point;
    distance2 += error.dot(found->covariance_m2.inverse() * error) / kTrials;
    chi2 += found->chi2 / kTrials;
  }
  // Three coordinates; eight numbers less three unknowns. Four standard deviations of the means.
  EXPECT_NEAR(distance2, 3.0, 4.0 * std::sqrt(6.0 / kTrials));
  EXPECT_NEAR(chi2, 5.0, 4.0 * std::sqrt(10.0 / kTrials));
}

TEST(Triangulate, NamesTheSightingThatContradicts) {
  const auto views = fourCameras();
  std::mt19937 random(3);
  auto sightings = sightingsOf(views, {0.05, 0.05, 0.0}, 0.01, random);
  sightings[2].pixel += Vec2(3.0, -2.0);
  const auto found = triangulate(views, sightings);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->worst, 2);
  EXPECT_GT(found->residual_px, 0.5);
}

TEST(Triangulate, NeedsTwoRaysThatMeet) {
  const auto views = fourCameras();
  std::mt19937 random(4);
  auto sightings = sightingsOf(views, {0.05, 0.05, 0.0}, 0.0, random);
  sightings.resize(1);
  EXPECT_FALSE(triangulate(views, sightings));
  sightings.push_back(sightings.front());
  EXPECT_FALSE(triangulate(views, sightings));
}

}  // namespace
}  // namespace tenter::reconstruction_test
