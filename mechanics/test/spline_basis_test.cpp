// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/spline_basis.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <random>

#include "allocation_count.h"

namespace tenter {
namespace {

constexpr double kRounding = 1e-13;
/// Solving for the coefficients multiplies rounding by the condition of the basis, below 1e3 here.
constexpr double kSolved = 1e-11;

struct Case {
  std::string name;
  SplineBasis basis;
};

std::vector<Case> cases() {
  return {
      {"constant", SplineBasis::constant()},
      {"even_constant", SplineBasis::constant(true)},
      {"one_knot", SplineBasis::onKnots({0.1}, false)},
      {"two", SplineBasis::onKnots({-0.1, 0.2}, false)},
      {"five_uneven", SplineBasis::onKnots({-0.05, 0.0, 0.01, 0.2, 0.5}, false)},
      {"even_two", SplineBasis::onKnots({0.0, 80.0}, true)},
      {"even_three", SplineBasis::onKnots({0.0, 0.1, 0.5}, true)},
      {"even_five", SplineBasis::onKnots({0.0, 5.0, 20.0, 30.0, 90.0}, true)},
  };
}

Eigen::VectorXd positiveCoefficients(const SplineBasis& basis, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> draw(-1.0, 2.0);
  Eigen::VectorXd c(basis.size());
  for (double& value : c) value = std::max(draw(random), 0.0);  // Many at their bound, as in a fit.
  c[0] += 0.1;
  return c;
}

std::vector<double> samples(const SplineBasis& basis, int count) {
  const double from = basis.knots().front(), to = basis.knots().back();
  const double margin = basis.knots().size() > 1 ? 0.2 * (to - from) : 1.0;
  std::vector<double> strains(basis.knots());
  for (int i = 0; i <= count; ++i)
    strains.push_back(from - margin + (to - from + 2 * margin) * i / count);
  if (basis.even())
    for (const double x : basis.knots()) strains.push_back(-x);
  return strains;
}

class SplineBasisTest : public testing::TestWithParam<Case> {
 protected:
  const SplineBasis& basis() const { return GetParam().basis; }
};

TEST_P(SplineBasisTest, HasTheDocumentedSize) {
  const int n = static_cast<int>(basis().knots().size());
  EXPECT_EQ(basis().size(), n == 1 ? 1 : (basis().even() ? n + 1 : n + 2));
}

TEST_P(SplineBasisTest, IsAPartitionOfUnityWithoutNegatives) {
  Eigen::VectorXd values(basis().size());
  for (const double e : samples(basis(), 500)) {
    basis().evaluate(e, values);
    EXPECT_NEAR(values.sum(), 1.0, kRounding);
    EXPECT_GE(values.minCoeff(), 0.0);
  }
}

TEST_P(SplineBasisTest, LocalValuesAreTheNonZeroOnes) {
  Eigen::VectorXd values(basis().size());
  for (const double e : samples(basis(), 50)) {
    basis().evaluate(e, values);
    const SplineBasis::Local local = basis().local(e);
    ASSERT_GE(local.first, 0);
    ASSERT_LE(local.first + local.count, basis().size());
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(basis().size());
    for (int j = 0; j < local.count; ++j) expected[local.first + j] = local.values[j];
    EXPECT_EQ(values, expected);
  }
}

TEST_P(SplineBasisTest, CurveIsTheWeightedSumOfTheFunctions) {
  Eigen::VectorXd values(basis().size());
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Eigen::VectorXd c = positiveCoefficients(basis(), seed);
    const StiffnessCurve curve = basis().curve(c);
    EXPECT_EQ(curve.even(), basis().even());
    for (const double e : samples(basis(), 500)) {
      basis().evaluate(e, values);
      EXPECT_NEAR(curve.evaluate(e).stiffness, values.dot(c), kRounding * c.maxCoeff()) << e;
    }
  }
}

TEST_P(SplineBasisTest, NonNegativeCoefficientsNeverGiveANegativeStiffness) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Eigen::VectorXd c = positiveCoefficients(basis(), seed);
    EXPECT_GE(basis().curve(c).minimumStiffness().value, -kRounding * c.maxCoeff());
  }
}

TEST_P(SplineBasisTest, CurvesAreTwiceContinuouslyDifferentiable) {
  const StiffnessCurve curve = basis().curve(positiveCoefficients(basis(), 3));
  const std::vector<double>&x = curve.strains(), &k = curve.stiffnesses(), &m = curve.tangents();
  const auto second = [&](std::size_t i,
                          bool at_end) {  // k'' of the Hermite interval i at one end.
    const double h = x[i + 1] - x[i], secant = (k[i + 1] - k[i]) / h;
    return at_end ? (2 * m[i] + 4 * m[i + 1] - 6 * secant) / h
                  : (6 * secant - 4 * m[i] - 2 * m[i + 1]) / h;
  };
  for (std::size_t i = 1; i + 1 < x.size(); ++i) {
    const double left = second(i - 1, true), right = second(i, false);
    const double h = std::min(x[i + 1] - x[i], x[i] - x[i - 1]);
    // Rounding of k, divided by the square of the shorter interval.
    EXPECT_NEAR(left, right, kRounding / (h * h) * 100);
  }
  if (basis().even()) {
    EXPECT_EQ(m.front(), 0.0);
  }
}

TEST_P(SplineBasisTest, CoefficientsComeBackFromTheCurve) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Eigen::VectorXd c = positiveCoefficients(basis(), seed);
    const Eigen::VectorXd back = basis().coefficientsOf(basis().curve(c));
    EXPECT_LT((back - c).cwiseAbs().maxCoeff(), kSolved * c.maxCoeff());
  }
}

TEST_P(SplineBasisTest, AddedKnotsKeepTheCurve) {
  std::vector<double> finer = basis().knots();
  for (std::size_t i = basis().knots().size(); i > 1; --i)
    finer.insert(finer.begin() + static_cast<std::ptrdiff_t>(i - 1),
                 0.5 * (finer[i - 2] + finer[i - 1]));
  const SplineBasis refined = SplineBasis::onKnots(finer, basis().even());
  const Eigen::VectorXd c = positiveCoefficients(basis(), 4);
  const StiffnessCurve before = basis().curve(c);
  const StiffnessCurve after = refined.curve(refined.coefficientsOf(before));
  for (const double e : samples(basis(), 100))
    EXPECT_NEAR(after.evaluate(e).stiffness, before.evaluate(e).stiffness, kSolved * c.maxCoeff());
}

TEST_P(SplineBasisTest, KnotValueMapGivesTheKnots) {
  const Eigen::VectorXd c = positiveCoefficients(basis(), 6);
  const Eigen::VectorXd values = basis().knotValueMap() * c;
  const StiffnessCurve curve = basis().curve(c);
  ASSERT_EQ(values.size(), curve.knotCount());
  for (int i = 0; i < values.size(); ++i)
    EXPECT_NEAR(values[i], curve.stiffnesses()[i], kRounding * c.maxCoeff());
}

TEST_P(SplineBasisTest, RoughnessIsPositiveSemiDefiniteAndSparesConstants) {
  const Eigen::MatrixXd r = basis().roughness();
  ASSERT_EQ(r.rows(), basis().size());
  EXPECT_EQ(r, r.transpose());
  const double scale = std::max(r.cwiseAbs().maxCoeff(), 1.0);
  const Eigen::VectorXd eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(r).eigenvalues();
  EXPECT_GE(eigenvalues[0], -kRounding * scale);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(basis().size());
  EXPECT_LT((r * ones).cwiseAbs().maxCoeff(), kRounding * scale);
  if (basis().size() > 1) {
    EXPECT_GT(eigenvalues.maxCoeff(), 1.0);
  }
}

TEST_P(SplineBasisTest, EvaluatesWithoutAllocating) {
  const std::vector<double> strains = samples(basis(), 50);
  Eigen::VectorXd values(basis().size());
  const std::size_t before = test_support::allocationCount();
  for (const double e : strains) basis().evaluate(e, values);
  EXPECT_EQ(test_support::allocationCount(), before);
}

INSTANTIATE_TEST_SUITE_P(AllBases, SplineBasisTest, testing::ValuesIn(cases()),
                         [](const auto& one) { return one.param.name; });

TEST(SplineBasis, RoughnessOfAStraightLineVanishes) {
  const SplineBasis basis = SplineBasis::onKnots({-0.05, 0.0, 0.01, 0.2, 0.5}, false);
  const auto line = StiffnessCurve::fromKnots({-0.05, 0.5}, {1.0, 12.0}, {20.0, 20.0}).value();
  const Eigen::VectorXd c = basis.coefficientsOf(line);
  EXPECT_NEAR(c.dot(basis.roughness() * c), 0.0, 1e-6);  // Squares of 1e-11 times 1e8 in R.
}

TEST(SplineBasis, RoughnessOfAParabolaIsItsSquaredSecondDerivative) {
  // k = x^2 on [0, 1]: k'' = 2, integral 4. Blossoming: c_j = (t1 t2 + t1 t3 + t2 t3) / 3, whose
  // second divided differences over uniform inner knots tend to 2.
  std::vector<double> knots;
  for (int i = 0; i <= 40; ++i) knots.push_back(i / 40.0);
  const SplineBasis basis = SplineBasis::onKnots(knots, false);
  const auto parabola = StiffnessCurve::fromKnots({0, 1}, {0, 1}, {0, 2}).value();
  const Eigen::VectorXd c = basis.coefficientsOf(parabola);
  EXPECT_NEAR(c.dot(basis.roughness() * c), 4.0, 0.2);  // Two end rows differ, of 41.
}

TEST(SplineBasis, FitsWhatLiesOutsideTheSpaceByLeastSquares) {
  const auto wavy = StiffnessCurve::fromKnots({0, 0.5, 1}, {1, 2, 1}, {0, 0, 0}).value();
  const SplineBasis basis = SplineBasis::onKnots({0.0, 1.0}, false);
  const StiffnessCurve fitted = basis.curve(basis.coefficientsOf(wavy));
  EXPECT_NEAR(fitted.evaluate(0.5).stiffness, 2.0, 0.2);
}

TEST(SplineBasis, RefusesBadKnots) {
  EXPECT_THROW(SplineBasis::onKnots({}, false), std::invalid_argument);
  EXPECT_THROW(SplineBasis::onKnots({0.0, 0.0}, false), std::invalid_argument);
  EXPECT_THROW(SplineBasis::onKnots({0.0, std::nan("")}, false), std::invalid_argument);
  EXPECT_THROW(SplineBasis::onKnots({0.1, 0.2}, true), std::invalid_argument);
  EXPECT_THROW(SplineBasis::constant().curve(Eigen::VectorXd::Ones(2)), std::invalid_argument);
}

}  // namespace
}  // namespace tenter
