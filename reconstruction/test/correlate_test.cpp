// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/correlate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "speckle.h"

namespace tenter::reconstruction_test {
namespace {

constexpr int kSide = 240, kStep_px = 10;
constexpr double kNoise = 2.0;
const Vec2 kCentre(120.0, 120.0);

using Change = std::function<void(GrayImage&)>;

/// A texture before and after a turn, a stretch and a shift, photographed.
struct Scene {
  explicit Scene(double degrees, double stretch, const Vec2& shift_px,
                 const Change& change = nullptr)
      : f(stretch * Eigen::Rotation2Dd(degrees * std::numbers::pi / 180.0).toRotationMatrix()),
        shift(shift_px) {
    const SpeckleTexture texture(3);
    before = photographed(seen(texture, kSide, kSide), kNoise, 1);
    after = seen(texture, kSide, kSide, [this](const Vec2& x) -> Vec2 {
      return kCentre + f.inverse() * (x - kCentre - shift);
    });
    if (change) change(after);
    after = photographed(after, kNoise, 2);
  }
  Vec2 displacement(const Vec2& x) const { return kCentre + f * (x - kCentre) + shift - x; }
  /// How many valid points are wrong: further off than noise explains.
  int wrong(const CorrelationField& field) const {
    return static_cast<int>(
        std::count_if(field.points.begin(), field.points.end(), [this](const CorrelatedPoint& p) {
          const Vec2 error = p.match.warp.displacement() - displacement(p.position);
          return p.valid() && error.norm() > 6.0 * p.sigma_px();
        }));
  }

  Mat2 f;
  Vec2 shift;
  GrayImage before, after;
};

CorrelationField correlated(const GrayImage& before, const GrayImage& after, int threads = 1) {
  CorrelateOptions options;
  options.threads = threads;
  return correlateGrid(before, after, kStep_px, options).value();
}

double validShare(const CorrelationField& field) {
  return static_cast<double>(field.count(PointState::kValid)) /
         static_cast<double>(field.points.size());
}

struct Motion {
  double degrees, stretch;
  Vec2 shift_px;
  double least_valid;  ///< Share that stays in view, less a margin.
};
class LargeMotion : public testing::TestWithParam<Motion> {};

TEST_P(LargeMotion, IsFoundFromNothing) {
  const Motion& motion = GetParam();
  const Scene scene(motion.degrees, motion.stretch, motion.shift_px);
  const CorrelationField field = correlated(scene.before, scene.after);
  EXPECT_GT(validShare(field), motion.least_valid);
  EXPECT_EQ(scene.wrong(field), 0);
}
INSTANTIATE_TEST_SUITE_P(Motions, LargeMotion,
                         testing::Values(Motion{0.0, 1.0, {3.3, -2.2}, 0.9},
                                         Motion{0.0, 1.0, {70.4, -45.2}, 0.45},
                                         Motion{15.0, 1.0, {5.0, 3.0}, 0.75},
                                         Motion{-40.0, 1.0, {0.0, 13.0}, 0.6},
                                         Motion{10.0, 1.2, {0.0, 3.0}, 0.5}));

TEST(Correlate, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene(10.0, 1.05, {12.0, 0.0});
  const auto one = correlated(scene.before, scene.after, 1);
  const auto three = correlated(scene.before, scene.after, 3);
  ASSERT_EQ(one.points.size(), three.points.size());
  for (std::size_t i = 0; i < one.points.size(); ++i) {
    ASSERT_EQ(one.points[i].state, three.points[i].state) << i;
    ASSERT_EQ(one.points[i].match.warp.u, three.points[i].match.warp.u) << i;
  }
}

TEST(Correlate, PointsOfTheirOwnAgreeWithTheGrid) {
  const Scene scene(5.0, 1.02, {20.0, -7.0});
  const std::vector<Vec2> points = {{100.0, 90.0}, {130.25, 140.75}, {4.0, 100.0}};
  const auto field = correlatePoints(scene.before, scene.after, points, {}).value();
  ASSERT_EQ(field.points.size(), 3U);
  EXPECT_TRUE(field.points[0].valid());
  EXPECT_TRUE(field.points[1].valid());
  EXPECT_EQ(field.points[2].state, PointState::kOutside);
  EXPECT_EQ(field.points[1].position, points[1]);
  EXPECT_EQ(scene.wrong(field), 0);
}

TEST(Correlate, ATextureThatRepeatsIsNeverMatched) {
  const SpeckleTexture texture(3);
  for (const double period : {14.0, 60.0}) {
    for (const double shift : {0.4, 0.6 * period}) {
      const auto tiled = [&](double by) {
        return photographed(seen(texture, kSide, kSide,
                                 [=](const Vec2& x) -> Vec2 {
                                   const auto wrapped = [=](double v) {
                                     return v - period * std::floor(v / period);
                                   };
                                   return {wrapped(x.x() - by), wrapped(x.y())};
                                 }),
                            kNoise, static_cast<unsigned>(period + by));
      };
      const auto field = correlated(tiled(0.0), tiled(shift));
      EXPECT_EQ(field.count(PointState::kValid), 0U) << period << ' ' << shift;
      EXPECT_GT(field.count(PointState::kAmbiguous), 0U);
      EXPECT_THAT(field.warnings, testing::Contains(testing::HasSubstr("repeats")));
    }
  }
}

TEST(Correlate, WhatIsHiddenIsNotMatched) {
  const SpeckleTexture other(99);
  const GrayImage hiding = seen(other, kSide, kSide);
  const Scene scene(1.0, 1.0, {5.3, 3.0}, [&](GrayImage& image) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = kSide / 2; x < kSide; ++x) image.at(x, y) = hiding.at(x, y);
    }
  });
  const auto field = correlated(scene.before, scene.after);
  EXPECT_EQ(scene.wrong(field), 0);
  EXPECT_GT(validShare(field), 0.3);
  EXPECT_LT(validShare(field), 0.5);
}

TEST(Correlate, SaturationIsNamedAndCutOffPointsDoNotCount) {
  const Scene scene(1.0, 1.0, {5.3, 3.0}, [](GrayImage& image) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) image.at(x, y) *= x < kSide / 2 ? 1.0F : 2.2F;
    }
  });
  const auto field = correlated(scene.before, scene.after);
  EXPECT_EQ(scene.wrong(field), 0);
  EXPECT_GT(field.count(PointState::kSaturated), 20U);
  EXPECT_GT(validShare(field), 0.3);
  EXPECT_THAT(field.warnings, testing::Contains(testing::HasSubstr("saturated")));
}

TEST(Correlate, DefocusIsNamedAndWhatItBlursIsUncertain) {
  const auto blurred = [](double sigma_px) {
    return [sigma_px](GrayImage& image) {
      cv::Mat1d pixels = matrixOf(image);
      cv::GaussianBlur(pixels, pixels, cv::Size(0, 0), sigma_px);
      image = imageOf(pixels);
    };
  };
  const Scene little(1.0, 1.0, {5.3, 3.0}, blurred(1.0)), much(1.0, 1.0, {5.3, 3.0}, blurred(3.0));
  const auto usable = correlated(little.before, little.after);
  EXPECT_GT(validShare(usable), 0.8);
  EXPECT_EQ(little.wrong(usable), 0);
  const auto useless = correlated(much.before, much.after);
  EXPECT_EQ(much.wrong(useless), 0);
  EXPECT_LT(validShare(useless), 0.1);
  EXPECT_THAT(useless.warnings, testing::Contains(testing::HasSubstr("less sharp")));
}

TEST(Correlate, ImagesWithNothingInCommonGiveNothing) {
  const auto one = photographed(seen(SpeckleTexture(3), kSide, kSide), kNoise, 1);
  const auto other = photographed(seen(SpeckleTexture(4), kSide, kSide), kNoise, 2);
  GrayImage flat(kSide, kSide);
  for (const GrayImage& after : {other, flat, photographed(flat, 10.0, 3)}) {
    EXPECT_EQ(correlated(one, after).count(PointState::kValid), 0U);
    EXPECT_EQ(correlated(after, one).count(PointState::kValid), 0U);
  }
}

TEST(Correlate, StopsWhenAskedTo) {
  const Scene scene(0.0, 1.0, {1.0, 1.0});
  CorrelateOptions options;
  options.keep_going = [](double share) { return share < 0.3; };
  const auto field = correlateGrid(scene.before, scene.after, kStep_px, options).value();
  EXPECT_LT(validShare(field), 0.7);
  EXPECT_GT(field.count(PointState::kNotFound), 0U);
}

TEST(Correlate, RefusesImagesThatDoNotBelongTogether) {
  const GrayImage image = seen(SpeckleTexture(3), 64, 48);
  GrayImage deep = image;
  deep.white = 65535.0F;
  const auto reason = [&](const GrayImage& after, int subset_px = 31) {
    CorrelateOptions options;
    options.match.subset_px = subset_px;
    const auto field = correlateGrid(image, after, 5, options);
    return field.ok() ? std::string() : field.error().reason;
  };
  EXPECT_EQ(reason(image), "");
  EXPECT_THAT(reason(seen(SpeckleTexture(3), 64, 49)),
              testing::HasSubstr("64 x 48 pixels and 64 x 49"));
  EXPECT_THAT(reason(deep), testing::HasSubstr("16"));
  EXPECT_THAT(reason(image, 47), testing::HasSubstr("too small"));
  EXPECT_THAT(correlatePoints(image, image, {{30.0, 20.0}, {64.0, 20.0}}, {}).error().place,
              "point 2");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(correlatePoints(image, image, {{nan, 20.0}}, {}).ok());
  EXPECT_FALSE(correlatePoints(image, image, {}, {}).ok());
}

}  // namespace
}  // namespace tenter::reconstruction_test
