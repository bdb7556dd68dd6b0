// SPDX-License-Identifier: GPL-3.0-or-later
// A hundred frames to 20 % stretch, 15 degrees of rotation and a quarter less contrast.
#include <gtest/gtest.h>

#include "errors.h"
#include "speckle.h"
#include "tenter/reconstruction/point_tracker.h"

namespace tenter::reconstruction_test {
namespace {

constexpr int kSide = 340, kFrames = 100;
constexpr double kNoise = 2.0;
const Vec2 kCentre(170.0, 170.0);

/// The cloth's state at a share of the way.
struct Pose {
  explicit Pose(double share) {
    const double stretch = 1.0 + 0.2 * share, turn = share * 15.0 * std::numbers::pi / 180.0;
    f = Eigen::Rotation2Dd(turn).toRotationMatrix();
    f.col(0) *= stretch;
    f.col(1) /= std::sqrt(stretch);
    shift = share * Vec2(10.0, -6.0);
    contrast = 1.0 - 0.25 * share;
  }
  GrayImage image(const SpeckleTexture& texture, unsigned seed) const {
    GrayImage image = seen(texture, kSide, kSide, [this](const Vec2& x) -> Vec2 {
      return kCentre + f.inverse() * (x - kCentre - shift);
    });
    for (float& pixel : image.pixels)
      pixel = 118.0F + static_cast<float>(contrast) * (pixel - 128.0F);
    return photographed(image, kNoise, seed);
  }
  SubsetWarp at(const Vec2& x) const {
    return SubsetWarp::affine(kCentre + f * (x - kCentre) + shift - x, f);
  }

  Mat2 f;
  Vec2 shift;
  double contrast;
};

Errors errorsOf(const CorrelationField& field, const Pose& pose) {
  Errors errors;
  for (const CorrelatedPoint& point : field.points) {
    if (!point.valid()) continue;
    const Vec2 error = point.match.warp.displacement() - pose.at(point.position).displacement();
    for (int axis = 0; axis < 2; ++axis) {
      errors.add(error[axis], std::sqrt(point.match.covariance_px2(axis, axis)));
    }
  }
  return errors;
}

TEST(Sequence, AHundredFramesDoNotDrift) {
  constexpr double kRms_px = 0.025, kLeastValid = 0.99;
  // Four standard deviations of the mean of what 34 subsets that do not overlap measure.
  constexpr double kBias_px = 0.01;
  std::vector<Vec2> points;
  for (int y = 80; y <= 260; y += 9) {
    for (int x = 80; x <= 260; x += 9) points.emplace_back(x + 0.3, y + 0.6);
  }
  const SpeckleTexture texture(7);
  const GrayImage first = Pose(0.0).image(texture, 1);
  auto tracker = PointTracker::create(first, points, {}).value();
  Errors last;
  for (int frame = 1; frame <= kFrames; ++frame) {
    const Pose pose(static_cast<double>(frame) / kFrames);
    const GrayImage image = pose.image(texture, 1U + static_cast<unsigned>(frame));
    const auto field = tracker.track(image).value();
    ASSERT_GE(static_cast<double>(field.count(PointState::kValid)),
              kLeastValid * static_cast<double>(points.size()))
        << frame;
    last = errorsOf(field, pose);
    ASSERT_LE(std::abs(last.mean()), kBias_px) << frame;
  }
  EXPECT_LE(last.rms(), kRms_px);

  // What the same frame gives when it is matched from the truth: the way there added nothing.
  const Pose pose(1.0);
  const GradientImage reference(first);
  const SplineImage deformed(pose.image(texture, 1U + kFrames));
  const SubsetMatcher matcher(reference, {});
  MatchScratch scratch;
  Errors direct;
  for (const Vec2& point : points) {
    const auto match = matcher.match(deformed, point, pose.at(point), scratch);
    const Vec2 error = match.warp.displacement() - pose.at(point).displacement();
    for (int axis = 0; axis < 2; ++axis) direct.add(error[axis], 1.0);
  }
  EXPECT_NEAR(last.rms(), direct.rms(), 0.02 * direct.rms());
}

}  // namespace
}  // namespace tenter::reconstruction_test
