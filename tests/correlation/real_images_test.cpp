// SPDX-License-Identifier: GPL-3.0-or-later
// The real pair of sample 5 of the DIC challenge, and fields made by moving its rows by their
// Fourier phases.
#include <gtest/gtest.h>

#include <map>

#include "errors.h"
#include "speckle.h"
#include "tenter/reconstruction/correlate.h"
#include "tenter/test_support/data.h"

namespace tenter::reconstruction_test {
namespace {

using test_support::findData;

/// Honest sigma: so much of the errors lie within one.
constexpr double kLeastInside = 0.65, kMostInside = 0.71;
constexpr int kStep_px = 5;

Vec2 sigmaOf(const CorrelatedPoint& point) {
  return point.match.covariance_px2.diagonal().cwiseSqrt();
}

TEST(RealImages, ATenthOfAPixelIsMeasuredWithoutBias) {
  const auto folder = findData("dic-sample5");
  if (!folder) GTEST_SKIP() << test_support::noData();
  constexpr double kTrueShift_px = 0.1, kMeanBias_px = 0.005, kColumnBias_px = 0.014;
  const GrayImage before = readGrayImage(*folder / "reference.tif").value().image;
  const GrayImage after = readGrayImage(*folder / "shifted.tif").value().image;
  const auto field = correlateGrid(before, after, kStep_px, {}).value();
  EXPECT_EQ(field.count(PointState::kValid), field.points.size());
  for (int axis = 0; axis < 2; ++axis) {
    Errors all;
    std::map<int, Errors> columns, rows;
    for (const CorrelatedPoint& point : field.points) {
      const double error = point.match.warp.displacement()[axis] - kTrueShift_px;
      all.add(error, sigmaOf(point)[axis]);
      columns[static_cast<int>(point.position.x())].add(error, 1.0);
      rows[static_cast<int>(point.position.y())].add(error, 1.0);
    }
    EXPECT_LE(std::abs(all.mean()), kMeanBias_px) << axis;
    for (const auto& [x, column] : columns) EXPECT_LE(std::abs(column.mean()), kColumnBias_px) << x;
    for (const auto& [y, row] : rows) EXPECT_LE(std::abs(row.mean()), kColumnBias_px) << y;
    EXPECT_GE(all.inside(), kLeastInside) << axis;
    EXPECT_LE(all.inside(), kMostInside) << axis;
  }
}

struct Wave {
  double amplitude_px, length_px;
};
class WavyField : public testing::TestWithParam<Wave> {};

/// Displacement along one axis as a sine of the other coordinate, with 2 grey levels of noise.
TEST_P(WavyField, IsMeasuredWithinItsNoise) {
  const auto folder = findData("dic-sample5");
  if (!folder) GTEST_SKIP() << test_support::noData();
  constexpr double kNoise = 2.0, kRms_px = 0.022, kBias_px = 0.002;
  // Near the border the moved rows come in from the other side.
  constexpr double kMargin_px = 40.0;
  const GrayImage real = readGrayImage(*folder / "reference.tif").value().image;
  const auto wave = [](double across) {
    return GetParam().amplitude_px *
           std::sin(2.0 * std::numbers::pi * across / GetParam().length_px);
  };
  for (const int axis : {0, 1}) {
    const GrayImage moved =
        axis == 0 ? rowsMoved(real, wave) : transposed(rowsMoved(transposed(real), wave));
    const auto field =
        correlateGrid(photographed(real, kNoise, 1), photographed(moved, kNoise, 2), kStep_px, {})
            .value();
    Errors along, across;
    double with_truth = 0.0, of_truth = 0.0;
    for (const CorrelatedPoint& point : field.points) {
      const Vec2& x = point.position;
      if (x.minCoeff() < kMargin_px || x.maxCoeff() > real.width - 1 - kMargin_px) continue;
      ASSERT_TRUE(point.valid()) << x.transpose();
      const double truth = wave(x[1 - axis]);
      const Vec2 measured = point.match.warp.displacement();
      along.add(measured[axis] - truth, sigmaOf(point)[axis]);
      across.add(measured[1 - axis], sigmaOf(point)[1 - axis]);
      with_truth += (measured[axis] - truth) * truth;
      of_truth += truth * truth;
    }
    for (const Errors& errors : {along, across}) {
      EXPECT_LE(errors.rms(), kRms_px);
      EXPECT_LE(std::abs(errors.mean()), kBias_px);
      EXPECT_GE(errors.inside(), kLeastInside);
      EXPECT_LE(errors.inside(), kMostInside);
    }
    // The part of the error that grows with the field, at its crest.
    EXPECT_LE(std::abs(with_truth / of_truth) * GetParam().amplitude_px, 2.0 * kBias_px);
  }
}
INSTANTIATE_TEST_SUITE_P(Waves, WavyField,
                         testing::Values(Wave{0.1, 120.0}, Wave{0.5, 120.0}, Wave{1.0, 170.0},
                                         Wave{4.0, 170.0}));

}  // namespace
}  // namespace tenter::reconstruction_test
