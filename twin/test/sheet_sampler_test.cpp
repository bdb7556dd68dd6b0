// SPDX-License-Identifier: GPL-3.0-or-later
#include "sheet_sampler.h"

#include <gtest/gtest.h>

#include <cmath>

#include "random_numbers.h"

namespace tenter {
namespace {

constexpr double kRounding = 1e-14;

class SheetSamplerTest : public testing::TestWithParam<DiagonalPattern> {
 protected:
  SheetSamplerTest()
      : lines_{linesThrough(0.0, 0.1, 13, {0.005, 0.093}), linesThrough(0.0, 0.1, 11, {0.031}),
               GetParam()} {
    RandomNumbers random(7, "places");
    places_.resize(2, 500);
    for (Eigen::Index p = 0; p < places_.cols(); ++p)
      places_.col(p) = 0.1 * Vec2(random.uniform(), random.uniform());
    places_.col(0) << 0.1, 0.1;
    places_.col(1) << 0.0, 0.0;
  }

  template <class F>
  Points3 nodes(F f) const {
    Points3 out(3, static_cast<Eigen::Index>(lines_.u_lines.size() * lines_.v_lines.size()));
    for (std::size_t j = 0; j < lines_.v_lines.size(); ++j) {
      for (std::size_t i = 0; i < lines_.u_lines.size(); ++i) {
        out.col(lines_.node(static_cast<int>(i), static_cast<int>(j))) =
            f(lines_.u_lines[i], lines_.v_lines[j]);
      }
    }
    return out;
  }

  template <class F>
  double worst(Sampling sampling, F f) const {
    const SheetSampler sampler(lines_, places_, sampling, {}, {0.031});
    const Points3 got = sampler.sample(nodes(f));
    double error = 0.0;
    for (Eigen::Index p = 0; p < places_.cols(); ++p) {
      error = std::max(error, (got.col(p) - f(places_(0, p), places_(1, p))).norm());
    }
    return error;
  }

  GridLines lines_;
  Points2 places_;
};

TEST_P(SheetSamplerTest, BothReproduceFlatSheets) {
  const auto flat = [](double x, double y) {
    return Vec3(1.1 * x - 0.2 * y, 0.3 * x + y, 0.01 + 0.5 * x);
  };
  EXPECT_LT(worst(Sampling::kLinear, flat), kRounding);
  EXPECT_LT(worst(Sampling::kCubic, flat), kRounding);
}

TEST_P(SheetSamplerTest, CubicReproducesConstantCurvatureWithABreakInIt) {
  // Curvature sets in at the break, as it does at the edge of a table.
  const auto bent = [](double x, double y) {
    const double s = std::max(0.0, y - 0.031);
    return Vec3(x, y, -20.0 * s * s + 5.0 * x * x);
  };
  EXPECT_LT(worst(Sampling::kCubic, bent), 1e-12);
  EXPECT_GT(worst(Sampling::kLinear, bent), 1e-5);
}

TEST_P(SheetSamplerTest, LinearFollowsTheTriangles) {
  // Height on one node alone: a tent over that node's triangles and no others.
  const SheetMesh sheet = gridSheet(lines_);
  Points3 heights = Points3::Zero(3, sheet.nodeCount());
  const int peak = lines_.node(5, 5);
  heights(2, peak) = 1.0;
  const Points3 got = SheetSampler(lines_, places_, Sampling::kLinear, {}, {}).sample(heights);
  for (Eigen::Index p = 0; p < places_.cols(); ++p) {
    double expected = 0.0;
    for (const Triangle& t : sheet.rest.triangles) {
      Mat2 edges;
      edges << sheet.rest.uv.col(t[1]) - sheet.rest.uv.col(t[0]),
          sheet.rest.uv.col(t[2]) - sheet.rest.uv.col(t[0]);
      const Vec2 st = edges.inverse() * (places_.col(p) - sheet.rest.uv.col(t[0]));
      const Vec3 shares(1.0 - st.sum(), st[0], st[1]);
      if (shares.minCoeff() < 0.0) continue;
      for (int i = 0; i < 3; ++i) {
        if (t[i] == peak) expected = shares[i];
      }
    }
    EXPECT_NEAR(got(2, p), expected, 1e-11);
  }
}

INSTANTIATE_TEST_SUITE_P(Patterns, SheetSamplerTest,
                         testing::Values(DiagonalPattern::kUniform, DiagonalPattern::kAlternating));

}  // namespace
}  // namespace tenter
