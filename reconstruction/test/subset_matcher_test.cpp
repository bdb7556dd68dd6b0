// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/subset_matcher.h"

#include <gtest/gtest.h>

#include "speckle.h"

namespace tenter::reconstruction_test {
namespace {

constexpr int kSide = 160;
const Vec2 kCentre(80.0, 80.0);

/// x_deformed = centre + F (x - centre) + t, on the texture.
struct AffineMotion {
  Mat2 f = Mat2::Identity();
  Vec2 t = Vec2::Zero();
  GrayImage image(const SpeckleTexture& texture) const {
    return seen(texture, kSide, kSide, [this](const Vec2& x) -> Vec2 {
      return kCentre + f.inverse() * (x - kCentre - t);
    });
  }
  SubsetWarp at(const Vec2& x) const {
    return SubsetWarp::affine(kCentre + f * (x - kCentre) + t - x, f);
  }
};

SubsetMatch matched(const GrayImage& reference, const GrayImage& deformed, const Vec2& point,
                    const SubsetWarp& guess, const MatchOptions& options = {}) {
  const GradientImage before(reference);
  const SplineImage after(deformed);
  MatchScratch scratch;
  return SubsetMatcher(before, options).match(after, point, guess, scratch);
}

class SubsetMatcherOrder : public testing::TestWithParam<int> {};

TEST_P(SubsetMatcherOrder, FindsAnAffineMotionFromAPixelAway) {
  const SpeckleTexture texture(3);
  AffineMotion motion;
  motion.f << 1.05, -0.04, 0.03, 0.97;
  motion.t = Vec2(2.3, -1.4);
  MatchOptions options;
  options.order = GetParam();
  const Vec2 point(70.0, 90.0);
  const SubsetWarp truth = motion.at(point);
  const SubsetWarp guess = SubsetWarp::translation(truth.displacement() + Vec2(0.7, -0.7));
  const auto match =
      matched(seen(texture, kSide, kSide), motion.image(texture), point, guess, options);
  ASSERT_EQ(match.end, MatchEnd::kConverged);
  // Without noise only interpolation is wrong.
  EXPECT_LT((match.warp.displacement() - truth.displacement()).norm(), 4e-3);
  EXPECT_LT((match.warp.linear() - truth.linear()).norm(), 2e-3);
  EXPECT_GT(match.zncc, 0.9999);
  EXPECT_NEAR(match.gain, 1.0, 0.02);
}
INSTANTIATE_TEST_SUITE_P(Orders, SubsetMatcherOrder, testing::Values(1, 2));

TEST(SubsetMatcher, FindsACurvedMotionWithTheSecondOrderOnly) {
  const SpeckleTexture texture(4);
  constexpr double kCurvature_per_px = 0.008;
  const auto material = [](const Vec2& x) -> Vec2 {
    const double dy = x.y() - kCentre.y();
    return {x.x() - 0.5 * kCurvature_per_px * dy * dy, x.y()};
  };
  const GrayImage before = seen(texture, kSide, kSide),
                  after = seen(texture, kSide, kSide, material);
  MatchOptions options;
  const auto second = matched(before, after, kCentre, {}, options);
  ASSERT_EQ(second.end, MatchEnd::kConverged);
  EXPECT_LT(second.warp.displacement().norm(), 5e-3);
  EXPECT_NEAR(second.warp.u[5], kCurvature_per_px, 2e-4);
  options.order = 1;
  EXPECT_GT(matched(before, after, kCentre, {}, options).warp.displacement().norm(), 0.2);
}

TEST(SubsetMatcher, DoesNotMindBrightnessAndContrast) {
  const SpeckleTexture texture(5);
  AffineMotion motion;
  motion.t = Vec2(0.4, 0.3);
  const GrayImage before = seen(texture, kSide, kSide);
  GrayImage after = motion.image(texture);
  const auto plain = matched(before, after, kCentre, {});
  for (float& pixel : after.pixels) pixel = 0.6F * pixel + 35.0F;
  const auto dimmed = matched(before, after, kCentre, {});
  EXPECT_LT((dimmed.warp.displacement() - plain.warp.displacement()).norm(), 1e-4);
  EXPECT_NEAR(dimmed.gain, 0.6 * plain.gain, 1e-3);
}

TEST(SubsetMatcher, APointBetweenPixelsIsReadOffTheWarp) {
  const SpeckleTexture texture(6);
  AffineMotion motion;
  motion.f << 1.02, 0.03, -0.01, 1.04;
  const GrayImage before = seen(texture, kSide, kSide), after = motion.image(texture);
  const auto on = matched(before, after, {60.0, 60.0}, motion.at({60.0, 60.0}));
  const auto beside = matched(before, after, {60.4, 59.7}, motion.at({60.4, 59.7}));
  const Vec2 expected = on.warp.displacementAt({0.4, -0.3});
  EXPECT_LT((beside.warp.displacement() - expected).norm(), 1e-4);
}

TEST(SubsetMatcher, StandardDeviationCoversTwoThirdsOfTheErrors) {
  constexpr double kNoise = 2.0;
  for (const double stretch : {1.0, 1.15}) {
    int inside = 0, count = 0;
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const SpeckleTexture texture(seed);
      AffineMotion motion;
      motion.f << stretch, 0.03, -0.03, 1.0 / stretch;
      motion.t = Vec2(0.35, -0.2);
      const GradientImage before(photographed(seen(texture, kSide, kSide), kNoise, 10 + seed));
      const SplineImage after(photographed(motion.image(texture), kNoise, 20 + seed));
      MatchOptions options;
      options.subset_px = 21;
      const SubsetMatcher matcher(before, options);
      MatchScratch scratch;
      for (int y = 26; y <= 134; y += 6) {
        for (int x = 26; x <= 134; x += 6) {
          const SubsetWarp truth = motion.at(Vec2(x, y));
          const auto match = matcher.match(after, Vec2(x, y), truth, scratch);
          if (match.end != MatchEnd::kConverged) continue;
          const Vec2 error = match.warp.displacement() - truth.displacement();
          for (int axis = 0; axis < 2; ++axis) {
            ++count;
            inside += std::abs(error[axis]) < std::sqrt(match.covariance_px2(axis, axis)) ? 1 : 0;
          }
        }
      }
    }
    ASSERT_GT(count, 1500);
    // Some 250 independent subsets fit in: their share of 0.683 is known to 0.02 by itself.
    EXPECT_NEAR(static_cast<double>(inside) / count, 0.683, 0.045) << stretch;
  }
}

TEST(SubsetMatcher, SaysWhyThereIsNoMatch) {
  const SpeckleTexture texture(7);
  const GrayImage image = seen(texture, kSide, kSide);
  GrayImage flat(kSide, kSide);
  EXPECT_EQ(matched(image, image, {10.0, 80.0}, {}).end, MatchEnd::kOutside);
  EXPECT_EQ(matched(image, image, kCentre, SubsetWarp::translation({70.0, 0.0})).end,
            MatchEnd::kOutside);
  EXPECT_EQ(matched(image, image, kCentre, SubsetWarp::translation({1e12, 0.0})).end,
            MatchEnd::kOutside);
  EXPECT_EQ(matched(flat, image, kCentre, {}).end, MatchEnd::kNoTexture);
  EXPECT_EQ(matched(image, flat, kCentre, {}).end, MatchEnd::kNoTexture);
  GrayImage stripes(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) stripes.at(x, y) = image.at(x, 0);
  }
  EXPECT_EQ(matched(stripes, stripes, kCentre, {}).end, MatchEnd::kNoTexture)
      << "moves unseen along y";
  MatchOptions once;
  once.max_iterations = 1;
  EXPECT_EQ(matched(image, image, kCentre, SubsetWarp::translation({0.5, 0.5}), once).end,
            MatchEnd::kNotConverged);
}

TEST(SubsetMatcher, RefusesOptionsThatMakeNoSense) {
  const auto refused = [](int subset_px, int order) {
    MatchOptions options;
    options.subset_px = subset_px;
    options.order = order;
    return !checkMatchOptions(options).ok();
  };
  EXPECT_FALSE(refused(31, 2));
  for (const int subset : {-1, 0, 5, 30, 257}) EXPECT_TRUE(refused(subset, 2)) << subset;
  for (const int order : {0, 3}) EXPECT_TRUE(refused(31, order)) << order;
}

}  // namespace
}  // namespace tenter::reconstruction_test
