// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <numbers>

#include "kind_fixtures.h"
#include "tenter/core/files.h"
#include "tenter/test_support/data.h"

namespace tenter {
namespace {

using kinds::clothParameters;
using kinds::constantCurve;
using kinds::jacobianError;
using kinds::modelNamed;
using kinds::onlyFree;

constexpr double kLength_m = 0.075, kDensity = 0.1;

Measurement cantilever(double angle_deg) {
  Measurement m;
  m.name = "cantilever";
  m.protocol = "cantilever";
  m.areal_density_kg_per_m2 = kDensity;
  m.cantilever = CantileverSetup{
      .length_m = kLength_m, .width_m = 0.02, .angle_rad = angle_deg * std::numbers::pi / 180.0};
  MeasurementFrame frame;
  frame.reach_m = 0.5 * kLength_m;
  frame.drop_m = 0.7 * kLength_m;
  m.frames.push_back(frame);
  return m;
}

/// Constant rigidity in all directions: the twist's is half of it, as strains hold twice the twist.
ParameterSet rigidity(const ClothModel& model, double gamma) {
  const double b = kDensity * kStandardGravity_m_per_s2 * std::pow(kLength_m, 3) / gamma;
  ParameterSet set = clothParameters(model);
  // Stiff in the plane, so that the strip is inextensible as the elastica is.
  for (int i = 0; i < 3; ++i) set.components[i] = constantCurve(1e5);
  set.components[3] = set.components[4] = constantCurve(b);
  set.components[5] = constantCurve(0.5 * b);
  return set;
}

struct Tip {
  double reach, drop;
};
Tip tipOf(FitTest& test) {
  Eigen::VectorXd r;
  const FrameOutcome outcome = test.evaluate(0, r, nullptr);
  EXPECT_TRUE(outcome.converged && outcome.stable) << outcome.problem;
  const MeasurementFrame& frame = test.measurement().frames[0];
  const double sigma = FitTestOptions{}.cantilever_sigma_m;
  return {frame.reach_m + sigma * r[0], frame.drop_m + sigma * r[1]};
}

TEST(CantileverKindTest, MatchesTheHeavyElastica) {
  const auto file = test_support::findData("bending/heavy-elastica.csv");
  if (!file) GTEST_SKIP() << test_support::noData();
  const Eigen::MatrixXd table = readNumericTable(*file, 6).value();
  const ClothModel& model = modelNamed("stvk");
  for (const DiagonalPattern pattern : {DiagonalPattern::kUniform, DiagonalPattern::kAlternating}) {
    FitTestOptions options;
    options.diagonals = pattern;
    auto test = makeFitTest(cantilever(0.0), model, options).value();
    for (Eigen::Index i = 0; i < table.rows(); ++i) {
      const double gamma = table(i, 0);
      test->setParameters(rigidity(model, gamma));
      test->restart();
      const Tip tip = tipOf(*test);
      const double tolerance = gamma >= 1.0 ? 0.01 : 0.02;
      EXPECT_NEAR(tip.reach / kLength_m, table(i, 1), tolerance * table(i, 1)) << "Gamma " << gamma;
      EXPECT_NEAR(tip.drop / kLength_m, table(i, 2), tolerance * table(i, 2)) << "Gamma " << gamma;
    }
  }
}

TEST(CantileverKindTest, ConvergesForAnyRigidityInAnyOrder) {
  const ClothModel& model = modelNamed("stvk");
  auto test = makeFitTest(cantilever(0.0), model, {}).value();
  for (const double gamma : {0.01, 200.0, 1.0, 50.0, 0.1, 17.5}) {
    test->setParameters(rigidity(model, gamma));
    Eigen::VectorXd r;
    Eigen::MatrixXd j;
    const FrameOutcome outcome = test->evaluate(0, r, &j);
    EXPECT_TRUE(outcome.converged && outcome.stable) << gamma << outcome.problem;
    test->accept();
  }
}

TEST(CantileverKindTest, AStoppedSearchIsNotAnAnswer) {
  const ClothModel& model = modelNamed("stvk");
  auto test = makeFitTest(cantilever(0.0), model, {}).value();
  test->setParameters(rigidity(model, 17.5));
  Eigen::VectorXd r;
  int polls = 0;
  test->cancelWhen([&] { return ++polls > 2; });
  const FrameOutcome stopped = test->evaluate(0, r, nullptr);
  EXPECT_TRUE(stopped.cancelled);
  EXPECT_FALSE(stopped.converged);
  EXPECT_EQ(polls, 3);  // no other start is tried
  test->accept();
  test->cancelWhen({});
  const FrameOutcome again = test->evaluate(0, r, nullptr);
  EXPECT_TRUE(again.converged && again.stable && !again.cancelled) << again.problem;
}

TEST(CantileverKindTest, JacobianMatchesFiniteDifferences) {
  for (const auto& [id, angle_deg] : {std::pair{"stvk", 90.0}, {"soft", 45.0}, {"springs", 0.0}}) {
    const ClothModel& model = modelNamed(id);
    FitTestOptions options;
    options.equilibrium_tolerance_N = 1e-13;
    auto test = makeFitTest(cantilever(angle_deg), model, options).value();
    EXPECT_LT(jacobianError(*test, onlyFree(clothParameters(model), true), 0, 2e-4),
              kinds::kJacobianTolerance)
        << id << " at " << angle_deg;
  }
}

}  // namespace
}  // namespace tenter
