// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/stiffness_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "allocation_count.h"
#include "curve_samples.h"

namespace tenter {
namespace {

using test_support::NamedCurve;
using test_support::sampleCurves;

/// Polynomials of degree 5 against an independent formula or against the exact quadrature of one:
/// rounding of some tens of operations.
constexpr double kRounding = 1e-13;
/// Central differences with step h = 1e-6 of the range: error h^2 of third derivatives and rounding
/// / h, both below.
constexpr double kFiniteDifference = 1e-7;

double rangeOf(const StiffnessCurve& curve) {
  return curve.knotCount() == 1 ? 1.0 : curve.strains().back() - curve.strains().front();
}

std::vector<double> samples(const StiffnessCurve& curve, int count) {
  std::mt19937 random(11);
  const double range = rangeOf(curve);
  std::uniform_real_distribution<double> draw(curve.strains().front() - range,
                                              curve.strains().back() + range);
  std::vector<double> strains;
  for (int i = 0; i < count; ++i) strains.push_back(draw(random));
  return strains;
}

/// k(e) by the cubic Hermite basis functions, constant beyond the ends.
double hermiteStiffness(const StiffnessCurve& curve, double strain) {
  const std::vector<double>&x = curve.strains(), &k = curve.stiffnesses(), &m = curve.tangents();
  const double e = curve.even() ? std::abs(strain) : strain;
  if (e <= x.front()) return k.front();
  if (e >= x.back()) return k.back();
  std::size_t i = 0;
  while (e > x[i + 1]) ++i;
  const double h = x[i + 1] - x[i], s = (e - x[i]) / h;
  return (1 + 2 * s) * (1 - s) * (1 - s) * k[i] + s * (1 - s) * (1 - s) * h * m[i] +
         s * s * (3 - 2 * s) * k[i + 1] - s * s * (1 - s) * h * m[i + 1];
}

/// Integral of k(s) s from 0 to e: three Gauss points are exact for the degree 4 of each stretch
/// between knots.
double integratedEnergy(const StiffnessCurve& curve, double strain) {
  const double end = curve.even() ? std::abs(strain) : strain;
  std::vector<double> cuts{0.0, end};
  for (const double x : curve.strains())
    if (x > std::min(0.0, end) && x < std::max(0.0, end)) cuts.push_back(x);
  std::sort(cuts.begin(), cuts.end());
  const double node = std::sqrt(0.6);
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double middle = 0.5 * (cuts[i] + cuts[i + 1]), half = 0.5 * (cuts[i + 1] - cuts[i]);
    for (const auto& [x, weight] : {std::pair{-node, 5.0 / 9}, {0.0, 8.0 / 9}, {node, 5.0 / 9}}) {
      const double s = middle + half * x;
      sum += weight * half * hermiteStiffness(curve, s) * s;
    }
  }
  return end < 0.0 ? -sum : sum;
}

class StiffnessCurveTest : public testing::TestWithParam<NamedCurve> {};

TEST_P(StiffnessCurveTest, StiffnessIsTheHermiteSpline) {
  const StiffnessCurve& curve = GetParam().curve;
  for (const double e : samples(curve, 300)) {
    const double expected = hermiteStiffness(curve, e);
    EXPECT_NEAR(curve.evaluate(e).stiffness, expected, 30 * kRounding * std::abs(expected)) << e;
  }
}

TEST_P(StiffnessCurveTest, EnergyIsTheIntegralOfTheStress) {
  const StiffnessCurve& curve = GetParam().curve;
  for (const double e : samples(curve, 300)) {
    const double expected = integratedEnergy(curve, e);
    EXPECT_NEAR(curve.evaluate(e).energy, expected, 30 * kRounding * std::abs(expected)) << e;
    EXPECT_EQ(curve.evaluate(e).stress, curve.evaluate(e).stiffness * e);
  }
}

TEST_P(StiffnessCurveTest, StressAndTangentAreDerivatives) {
  const StiffnessCurve& curve = GetParam().curve;
  const double h = 1e-6 * rangeOf(curve);
  for (const double e : samples(curve, 300)) {
    bool near_knot =
        false;  // The extension has a kink at the outer knots, and k'' one at all of them.
    for (const double x : curve.strains()) near_knot |= std::abs(std::abs(e) - std::abs(x)) < 2 * h;
    if (near_knot) continue;
    const CurveValue before = curve.evaluate(e - h), at = curve.evaluate(e),
                     after = curve.evaluate(e + h);
    const double scale = std::max(std::abs(at.tangent), at.stiffness);
    EXPECT_NEAR((after.energy - before.energy) / (2 * h), at.stress,
                kFiniteDifference * scale * (rangeOf(curve) + std::abs(e)));
    EXPECT_NEAR((after.stress - before.stress) / (2 * h), at.tangent,
                kFiniteDifference * scale * 10);
  }
}

TEST_P(StiffnessCurveTest, EnergyKeepsItsDigitsNearZero) {
  const StiffnessCurve& curve = GetParam().curve;
  const double k = curve.evaluate(0.0).stiffness;
  for (const double scale : {1e-5, 1e-8, 1e-12, 1e-100})
    for (const double sign : {-1.0, 1.0}) {
      const double e = sign * scale * rangeOf(curve);
      const double expected = integratedEnergy(curve, e);
      EXPECT_NEAR(curve.evaluate(e).energy / expected, 1.0, 30 * kRounding) << e;
      if (scale < 1e-10) {
        EXPECT_NEAR(curve.evaluate(e).energy / (0.5 * k * e * e), 1.0, 1e-9) << e;
      }
    }
  EXPECT_EQ(curve.evaluate(0.0).energy, 0.0);
  EXPECT_EQ(curve.evaluate(0.0).stress, 0.0);
}

TEST_P(StiffnessCurveTest, IsConstantBeyondItsKnots) {
  const StiffnessCurve& curve = GetParam().curve;
  const double end = curve.strains().back(), far = end + 2 * rangeOf(curve);
  const double k = curve.stiffnesses().back();
  EXPECT_EQ(curve.evaluate(far).stiffness, k);
  EXPECT_EQ(curve.evaluate(far).tangent, k);
  const double step = 0.5 * k * (far * far - end * end);
  EXPECT_NEAR(curve.evaluate(far).energy - curve.evaluate(end).energy, step,
              1e-12 * std::abs(curve.evaluate(far).energy));
}

TEST_P(StiffnessCurveTest, HitsItsKnotsExactlyOrToRounding) {
  const StiffnessCurve& curve = GetParam().curve;
  for (int i = 0; i < curve.knotCount(); ++i)
    EXPECT_NEAR(curve.evaluate(curve.strains()[i]).stiffness, curve.stiffnesses()[i],
                10 * kRounding * std::abs(curve.stiffnesses()[i]));
}

TEST_P(StiffnessCurveTest, EvenCurvesAreMirrored) {
  const StiffnessCurve& curve = GetParam().curve;
  if (!curve.even()) return;
  for (const double e : samples(curve, 50)) {
    const CurveValue a = curve.evaluate(e), b = curve.evaluate(-e);
    EXPECT_EQ(a.stiffness, b.stiffness);
    EXPECT_EQ(a.energy, b.energy);
    EXPECT_EQ(a.stress, -b.stress);
    EXPECT_EQ(a.tangent, b.tangent);
  }
}

TEST_P(StiffnessCurveTest, MinimumIsBelowEverySampleAndReached) {
  const StiffnessCurve& curve = GetParam().curve;
  const auto [strain, value] = curve.minimumStiffness();
  EXPECT_NEAR(curve.evaluate(strain).stiffness, value, 1e-12 * std::abs(value));
  for (const double e : samples(curve, 2000))
    EXPECT_GE(curve.evaluate(e).stiffness, value * (1 - 1e-12));
}

TEST_P(StiffnessCurveTest, SofteningIntervalsAreWhereTheTangentIsNegative) {
  const StiffnessCurve& curve = GetParam().curve;
  const auto intervals = curve.softeningIntervals();
  const double margin = 1e-9 * rangeOf(curve);
  for (const double e : samples(curve, 3000)) {
    if (e <= curve.strains().front() || e >= curve.strains().back()) continue;
    bool inside = false, at_end = false;
    for (const auto& [from, to] : intervals) {
      inside |= e > from && e < to;
      at_end |= std::abs(e - from) < margin || std::abs(e - to) < margin;
    }
    if (!at_end) {
      EXPECT_EQ(curve.evaluate(e).tangent < 0.0, inside) << e;
    }
  }
}

TEST_P(StiffnessCurveTest, ScalesEverything) {
  const StiffnessCurve& curve = GetParam().curve;
  const StiffnessCurve twice = curve.scaled(2.0);  // A power of two: exact.
  for (const double e : samples(curve, 20)) {
    EXPECT_EQ(twice.evaluate(e).energy, 2.0 * curve.evaluate(e).energy);
    EXPECT_EQ(twice.evaluate(e).tangent, 2.0 * curve.evaluate(e).tangent);
  }
}

TEST_P(StiffnessCurveTest, EvaluatesWithoutAllocating) {
  const StiffnessCurve& curve = GetParam().curve;
  const std::vector<double> strains = samples(curve, 50);
  double sum = 0.0;
  const std::size_t before = test_support::allocationCount();
  for (const double e : strains) sum += curve.evaluate(e).energy;
  EXPECT_EQ(test_support::allocationCount(), before);
  EXPECT_TRUE(std::isfinite(sum));
}

INSTANTIATE_TEST_SUITE_P(AllShapes, StiffnessCurveTest, testing::ValuesIn(sampleCurves()),
                         [](const auto& one) {
                           std::string name = one.param.name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(StiffnessCurve, FindsADipBetweenPositiveKnots) {
  // k = 1 - 8 s + 8 s^2 on [0, 1]: 1 at both ends, -1 in the middle.
  const auto curve = StiffnessCurve::fromKnots({0, 1}, {1, 1}, {-8, 8}).value();
  EXPECT_NEAR(curve.minimumStiffness().value, -1.0, kRounding);
  EXPECT_NEAR(curve.minimumStiffness().strain, 0.5, kRounding);
}

TEST(StiffnessCurve, FindsSofteningByItsClosedForm) {
  // k = 3 - 3 s on [0, 1]: d(k s)/ds = 3 - 6 s.
  const auto curve = StiffnessCurve::fromKnots({0, 1}, {3, 0}, {-3, -3}).value();
  const auto intervals = curve.softeningIntervals();
  ASSERT_EQ(intervals.size(), 1u);
  EXPECT_NEAR(intervals[0].first, 0.5, kRounding);
  EXPECT_EQ(intervals[0].second, 1.0);
}

TEST(StiffnessCurve, JoinsSofteningAcrossKnots) {
  const auto curve = StiffnessCurve::fromKnots({0, 1, 2}, {3, 0.5, -3}, {-3, -3, -3}).value();
  const auto intervals = curve.softeningIntervals();
  ASSERT_EQ(intervals.size(), 1u);
  EXPECT_EQ(intervals[0].second, 2.0);
}

TEST(StiffnessCurve, CallsNoConstantOrZeroCurveSoft) {
  EXPECT_TRUE(StiffnessCurve::fromKnots({0, 1}, {0, 0}, {0, 0})->softeningIntervals().empty());
  EXPECT_TRUE(StiffnessCurve::fromKnots({-1, 1}, {5, 5}, {0, 0})->softeningIntervals().empty());
}

TEST(StiffnessCurve, RefusesWhatIsNoCurve) {
  const double nan = std::nan(""), inf = INFINITY;
  const auto reason = [](const Result<StiffnessCurve>& result) {
    return result.ok() ? "" : result.error().message();
  };
  using testing::HasSubstr;
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({}, {}, {})), HasSubstr("at least one knot"));
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({0, 1}, {1}, {0, 0})), HasSubstr("differ"));
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({0, 1}, {1, 1}, {0})), HasSubstr("differ"));
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({0, 0}, {1, 1}, {0, 0})), HasSubstr("knot 1"));
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({0, -1}, {1, 1}, {0, 0})), HasSubstr("knot 1"));
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({0, nan}, {1, 1}, {0, 0})), HasSubstr("finite"));
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({0, 1}, {1, inf}, {0, 0})), HasSubstr("finite"));
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({0, 1}, {1, 1}, {nan, 0})), HasSubstr("finite"));
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({0, 1e-320}, {1, 2}, {0, 0})),
              HasSubstr("too close"));
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({0.1, 1}, {1, 1}, {0, 0}, true)), HasSubstr("even"));
  EXPECT_THAT(reason(StiffnessCurve::fromKnots({0, 1}, {1, 1}, {1, 0}, true)), HasSubstr("even"));
  EXPECT_TRUE(StiffnessCurve::fromKnots({0, 1}, {-1, 1}, {0, 0}).ok());
}

}  // namespace
}  // namespace tenter
