// SPDX-License-Identifier: GPL-3.0-or-later
#include "height_filter.h"

#include <gtest/gtest.h>

#include <random>

#include "sheet_heights.h"

namespace tenter {
namespace {

constexpr int kHalf_px = 15, kSpacing_px = 6, kNodes = 41, kReach = 3, kPasses = 3;
constexpr double kHalfCells = (kHalf_px + 0.5) / kSpacing_px;
constexpr int kMargin = 15;  ///< Nodes from the border that its smoothing reaches.

TEST(HeightFilter, WithoutPassesItIsThatOfTheFirstMatches) {
  // A quadratic subset's value at the middle has 7/2 of the variance of an affine one's.
  const HeightFilter filter = heightFilter(2, kHalfCells, kReach, 0);
  EXPECT_NEAR(filter.noise.own, 3.5, 1e-3);
  EXPECT_NEAR(filter.noise.with_match, 1.0, 1e-3);
  EXPECT_NEAR(filter.noise.with_tracking, 3.5, 1e-3);
  EXPECT_NEAR(filter.difference, 0.0, 1e-12);
  EXPECT_NEAR(filter.leak, 1.0, 1e-12);
}

TEST(SubsetWeights, SeeAQuadricAsTheirOrderTells) {
  const SubsetWeights subset(kHalfCells);
  double affine = 0.0, quadratic = 0.0, all = 0.0;
  for (int node = -subset.half; node <= subset.half; ++node) {
    const auto at = static_cast<std::size_t>(node + subset.half);
    all += subset.mean[at];
    affine += subset.mean[at] * node * node;
    quadratic += subset.quadratic[at] * node * node;
  }
  EXPECT_NEAR(all, 1.0, 1e-12);
  EXPECT_NEAR(affine, kHalfCells * kHalfCells / 3.0, 1e-3 * kHalfCells * kHalfCells);
  EXPECT_NEAR(quadratic, 0.0, 1e-3 * kHalfCells * kHalfCells);
}

/// Noise in every pixel, as subsets of an affine or a quadratic warp at the nodes see it.
struct NoiseSeen {
  std::vector<double> mean, quadratic;

  explicit NoiseSeen(unsigned seed) {
    constexpr int kSide_px = kSpacing_px * (kNodes - 1) + 2 * kHalf_px + 1;
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, 2.0 * kHalf_px + 1.0);
    std::vector<double> field(static_cast<std::size_t>(kSide_px) * kSide_px);
    for (double& pixel : field) pixel = normal(random);
    constexpr double kCount = (2 * kHalf_px + 1.0) * (2 * kHalf_px + 1.0);
    for (int row = 0; row < kNodes; ++row) {
      for (int column = 0; column < kNodes; ++column) {
        double plain = 0.0, fitted = 0.0;
        for (int y = 0; y <= 2 * kHalf_px; ++y) {
          for (int x = 0; x <= 2 * kHalf_px; ++x) {
            const double s = (x - kHalf_px) / (kHalf_px + 0.5);
            const double t = (y - kHalf_px) / (kHalf_px + 0.5);
            const double value = field[static_cast<std::size_t>(row * kSpacing_px + y) * kSide_px +
                                       static_cast<std::size_t>(column * kSpacing_px + x)];
            plain += value;
            fitted += (3.5 - 3.75 * (s * s + t * t)) * value;
          }
        }
        mean.push_back(plain / kCount);
        quadratic.push_back(fitted / kCount);
      }
    }
  }
};

TEST(HeightFilter, SaysWhatPassesMakeOfNoise) {
  SheetGrid grid;
  grid.columns = grid.rows = kNodes;
  grid.spacing_m = Vec2::Ones();
  std::vector<Vec3> flat;
  for (int i = 0; i < kNodes * kNodes; ++i)
    flat.push_back(Vec3(grid.place(i).x(), grid.place(i).y(), 0.0));
  const HeightField plane(flat, 1.0);
  const SubsetWeights subset(kHalfCells);
  double own = 0.0, with_match = 0.0, with_tracking = 0.0, difference = 0.0, unit = 0.0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const NoiseSeen noise(seed);
    SheetHeights heights(grid, plane);
    for (int i = 0; i < heights.count(); ++i) heights.setHeight(i, noise.quadratic[i]);
    for (int pass = 0; pass < kPasses; ++pass) {
      const SheetHeights smooth = heights.smoothed(kReach);
      const SheetHeights seen = smooth.seenBySubsets(subset, 1);
      for (int i = 0; i < heights.count(); ++i)
        heights.setHeight(i, smooth.height(i) + noise.mean[i] - seen.height(i));
    }
    for (int row = kMargin; row < kNodes - kMargin; ++row) {
      for (int column = kMargin; column < kNodes - kMargin; ++column) {
        const int i = row * kNodes + column;
        own += heights.height(i) * heights.height(i);
        with_match += heights.height(i) * noise.mean[i];
        with_tracking += heights.height(i) * noise.quadratic[i];
        difference += std::pow(noise.quadratic[i] - heights.height(i), 2);
        unit += noise.mean[i] * noise.mean[i];
      }
    }
  }
  const HeightFilter filter = heightFilter(2, kHalfCells, kReach, kPasses);
  std::printf("own %.2f %.2f with match %.2f %.2f with tracking %.2f %.2f difference %.2f %.2f\n",
              filter.noise.own, own / unit, filter.noise.with_match, with_match / unit,
              filter.noise.with_tracking, with_tracking / unit, filter.difference,
              difference / unit);
  // Some six independent values a field, sixty fields: 7 % for a variance, twice that at most.
  constexpr double kTolerance = 0.14;
  EXPECT_NEAR(own / unit, filter.noise.own, kTolerance * filter.noise.own);
  EXPECT_NEAR(with_match / unit, filter.noise.with_match, kTolerance * filter.noise.with_match);
  EXPECT_NEAR(with_tracking / unit, filter.noise.with_tracking,
              kTolerance * filter.noise.with_tracking);
  EXPECT_NEAR(difference / unit, filter.difference, kTolerance * filter.difference);
}

}  // namespace
}  // namespace tenter
