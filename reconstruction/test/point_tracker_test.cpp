// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/point_tracker.h"

#include <gtest/gtest.h>

#include "speckle.h"

namespace tenter::reconstruction_test {
namespace {

constexpr int kSide = 200;
constexpr double kNoise = 2.0;

std::vector<Vec2> trackedPoints() {
  std::vector<Vec2> points;
  for (int y = 50; y <= 150; y += 10) {
    for (int x = 50; x <= 150; x += 10) points.emplace_back(x + 0.3, y + 0.6);
  }
  return points;
}

GrayImage shifted(const SpeckleTexture& texture, const Vec2& by, unsigned seed) {
  return photographed(seen(texture, kSide, kSide, [by](const Vec2& x) -> Vec2 { return x - by; }),
                      kNoise, seed);
}

double worstError(const CorrelationField& field, const Vec2& truth) {
  double worst = 0.0;
  for (const CorrelatedPoint& point : field.points) {
    if (point.valid()) worst = std::max(worst, (point.match.warp.displacement() - truth).norm());
  }
  return worst;
}

TEST(PointTracker, FollowsStepsOfSeveralPixels) {
  const SpeckleTexture texture(8);
  auto tracker =
      PointTracker::create(shifted(texture, Vec2::Zero(), 1), trackedPoints(), {}).value();
  for (unsigned frame = 1; frame <= 5; ++frame) {
    const Vec2 truth = frame * Vec2(4.3, -2.6);
    const auto field = tracker.track(shifted(texture, truth, 1 + frame)).value();
    EXPECT_EQ(field.count(PointState::kValid), trackedPoints().size()) << frame;
    EXPECT_LT(worstError(field, truth), 0.1) << frame;
  }
}

TEST(PointTracker, FindsPointsAgainThatWereHidden) {
  const SpeckleTexture texture(8);
  auto tracker =
      PointTracker::create(shifted(texture, Vec2::Zero(), 1), trackedPoints(), {}).value();
  GrayImage hidden = shifted(texture, {1.0, 0.0}, 2);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide / 2; ++x) hidden.at(x, y) = 90.0F;
  }
  const auto half = tracker.track(hidden).value();
  EXPECT_LT(half.count(PointState::kValid), trackedPoints().size() * 2 / 3);
  EXPECT_GT(half.count(PointState::kValid), trackedPoints().size() / 3);
  EXPECT_LT(worstError(half, {1.0, 0.0}), 0.15);
  const auto again = tracker.track(shifted(texture, {2.0, 0.0}, 3)).value();
  EXPECT_EQ(again.count(PointState::kValid), trackedPoints().size());
  EXPECT_LT(worstError(again, {2.0, 0.0}), 0.1);
}

TEST(PointTracker, RefusesAnotherSizeAndGoesOn) {
  const SpeckleTexture texture(8);
  auto tracker =
      PointTracker::create(shifted(texture, Vec2::Zero(), 1), trackedPoints(), {}).value();
  EXPECT_FALSE(tracker.track(seen(texture, kSide, kSide - 1)).ok());
  EXPECT_EQ(tracker.track(shifted(texture, {1.0, 0.0}, 2))->count(PointState::kValid),
            trackedPoints().size());
  EXPECT_FALSE(PointTracker::create(seen(texture, kSide, kSide), {{-1.0, 4.0}}, {}).ok());
}

}  // namespace
}  // namespace tenter::reconstruction_test
