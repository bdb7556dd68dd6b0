// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <random>
#include <thread>

#include "cloth_fixture.h"
#include "position_residuals.h"

namespace tenter {
namespace {

using kinds::clothParameters;
using kinds::jacobianError;
using kinds::modelNamed;
using kinds::syntheticCloth;

FitTestOptions smallReplica() {
  FitTestOptions options;
  options.nodes = 11;
  options.equilibrium_tolerance_N = 1e-12;
  return options;
}

std::unique_ptr<FitTest> make(const Measurement& m, const ClothModel& model,
                              const FitTestOptions& options) {
  auto test = makeFitTest(m, model, options);
  if (!test) throw std::runtime_error(test.error().message());
  return std::move(*test);
}

ParameterSet disturbed(ParameterSet set, double factor) {
  set.setCoefficients(factor * set.coefficients());
  return set;
}

class ClothKindTest : public testing::TestWithParam<const char*> {};

TEST_P(ClothKindTest, TruthHasNoResidual) {
  const ClothModel& model = modelNamed(GetParam());
  const ParameterSet truth = clothParameters(model);
  for (const char* protocol : {"stretch-weft", "stretch-warp", "shear", "bend-weft", "bend-warp"}) {
    auto test = make(syntheticCloth(protocol, truth, smallReplica()), model, smallReplica());
    test->setParameters(truth);
    for (int f = 0; f < test->frameCount(); ++f) {
      Eigen::VectorXd r;
      EXPECT_TRUE(test->evaluate(f, r, nullptr).converged);
      EXPECT_EQ(r.size(), test->residualCount(f));
      // The sigmas are 5e-5 m and millinewtons, so this is a nanometre and a micronewton.
      EXPECT_LT(r.cwiseAbs().maxCoeff(), 1e-4) << protocol;
      const FramePrediction p = test->predict(f, false);
      EXPECT_LT(p.position_rms_m, 1e-8) << protocol;
      EXPECT_NEAR(p.summary_predicted, p.summary_measured,
                  1e-6 * std::abs(p.summary_measured) + 1e-7)
          << protocol;
    }
    EXPECT_NEAR(test->constantCost(), 0.0, 1e-8);
  }
}

TEST_P(ClothKindTest, JacobianMatchesFiniteDifferences) {
  const ClothModel& model = modelNamed(GetParam());
  const ParameterSet truth = clothParameters(model);
  for (const char* protocol : {"stretch-weft", "shear", "bend-weft", "corner-pull"}) {
    auto test = make(syntheticCloth(protocol, truth, smallReplica()), model, smallReplica());
    // Off the truth, so that no term vanishes with the residual.
    EXPECT_LT(jacobianError(*test, disturbed(truth, 1.1), 1), kinds::kJacobianTolerance)
        << protocol;
  }
}

std::string modelName(const testing::TestParamInfo<const char*>& model) {
  std::string name = model.param;
  std::erase(name, '-');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Models, ClothKindTest,
                         testing::Values("springs", "soft", "stvk", "stvk-coupled"), modelName);

TEST(ClothKindFramesTest, ThreadsGiveWhatOneThreadGives) {
  const ClothModel& model = modelNamed("stvk");
  const ParameterSet truth = clothParameters(model);
  const Measurement m = syntheticCloth("stretch-weft", truth, smallReplica(), 6);
  auto serial = make(m, model, smallReplica()), parallel = make(m, model, smallReplica());
  std::vector<Eigen::VectorXd> expected(6), found(6);
  std::vector<Eigen::MatrixXd> expected_jacobian(6), found_jacobian(6);
  const ParameterSet at = disturbed(truth, 0.9);
  serial->setParameters(at);
  parallel->setParameters(at);
  for (int f = 0; f < 6; ++f) serial->evaluate(f, expected[f], &expected_jacobian[f]);
  std::vector<std::jthread> threads;
  for (int t = 0; t < 3; ++t)
    threads.emplace_back([&, t] {
      for (int f = t; f < 6; f += 3) parallel->evaluate(f, found[f], &found_jacobian[f]);
    });
  threads.clear();
  for (int f = 0; f < 6; ++f) {
    EXPECT_EQ(found[f], expected[f]) << "frame " << f;
    EXPECT_EQ(found_jacobian[f], expected_jacobian[f]) << "frame " << f;
  }
}

TEST(ClothKindFramesTest, TangentPredictorSavesNewtonSteps) {
  const ClothModel& model = modelNamed("stvk");
  const ParameterSet truth = clothParameters(model);
  FitTestOptions options = smallReplica();
  options.equilibrium_tolerance_N = 0.0;  // the one that fits use
  auto test = make(syntheticCloth("bend-weft", truth, options, 1), model, options);
  Eigen::VectorXd r;
  Eigen::MatrixXd j;
  test->setParameters(truth);
  const int cold = test->evaluate(0, r, &j).newton_steps;
  test->accept();
  test->setParameters(disturbed(truth, 1.01));
  const int warm = test->evaluate(0, r, &j).newton_steps;
  EXPECT_LT(warm, cold);
  EXPECT_LE(warm, 3);
  // The same point again costs a factorisation, not a solve.
  EXPECT_EQ(test->evaluate(0, r, &j).newton_steps, 0);
}

TEST(ClothKindFramesTest, CrossCheckAgreesWhereOneShapeExists) {
  const ClothModel& model = modelNamed("stvk");
  const ParameterSet truth = clothParameters(model);
  auto test = make(syntheticCloth("bend-weft", truth, smallReplica(), 1), model, smallReplica());
  EXPECT_FALSE(test->crossCheck(0).checked);
  Eigen::VectorXd r;
  test->setParameters(truth);
  test->evaluate(0, r, nullptr);
  const MultistabilityReport report = test->crossCheck(0);
  EXPECT_TRUE(report.checked);
  EXPECT_FALSE(report.disagrees);
  EXPECT_LT(report.position_rms_m, 1e-7);
}

TEST(ClothKindFramesTest, ClipPoseErrorWidensStiffDirectionsOnly) {
  const ClothModel& model = modelNamed("stvk");
  const ParameterSet truth = clothParameters(model);
  Measurement m = syntheticCloth("stretch-weft", truth, smallReplica(), 1);
  const auto sigma = [&](double pose_m) {
    m.clip_position_sigma_m = pose_m;
    m.clip_rotation_sigma_rad = 0.0;
    auto test = make(m, model, smallReplica());
    test->setParameters(truth);
    return test->predict(0, false).summary_sigma;
  };
  // Both bars move independently: the axial force errs by stiffness times sqrt(2) sigma.
  const double without = sigma(0.0), with = sigma(1e-4);
  const double pose = std::sqrt(with * with - without * without) / (std::sqrt(2.0) * 1e-4);
  m.clip_position_sigma_m = 0.0;
  auto test = make(m, model, smallReplica());
  test->setParameters(truth);
  const double force = test->predict(0, false).summary_predicted;
  // Tangent stiffness at 1.7 % strain is near the secant one: the curve rises by a quarter over its
  // range.
  EXPECT_NEAR(pose, force / 0.0015, 0.3 * force / 0.0015);
}

/// A ripple that no law of the model follows, of 0.3 mm where the noise is said to be 0.05 mm.
TEST(ClothKindFramesTest, WhatTheLawCannotFollowIsWeighedBesideTheNoise) {
  const ClothModel& model = modelNamed("stvk");
  const ParameterSet truth = clothParameters(model);
  constexpr double kRipple_m = 3e-4;
  Measurement m = syntheticCloth("bend-weft", truth, smallReplica());
  for (MeasurementFrame& frame : m.frames)
    frame.positions.row(2) += kRipple_m * (300.0 * m.rest->uv.row(1)).array().sin().matrix();
  auto test = make(m, model, smallReplica());
  test->setParameters(truth);
  const auto misfit = [&] {
    double sum = 0.0;
    int count = test->constantCount();
    for (int f = 0; f < test->frameCount(); ++f) {
      Eigen::VectorXd r;
      EXPECT_TRUE(test->evaluate(f, r, nullptr).converged);
      sum += r.squaredNorm();
      count += static_cast<int>(r.size());
    }
    return (sum + test->constantCost()) / count;
  };
  EXPECT_GT(misfit(), 5.0);
  EXPECT_FALSE(test->updateDiscrepancy()) << "nothing is accepted yet";
  test->accept();
  EXPECT_TRUE(test->updateDiscrepancy());
  EXPECT_NEAR(test->discrepancy_m(), kRipple_m / std::sqrt(6.0), 0.1 * kRipple_m / std::sqrt(6.0));
  EXPECT_NEAR(misfit(), 1.0, 0.05);
  EXPECT_FALSE(test->updateDiscrepancy()) << "the same states say the same";
}

TEST(ClothKindFramesTest, NoiseIsNoDiscrepancy) {
  const ClothModel& model = modelNamed("stvk");
  const ParameterSet truth = clothParameters(model);
  Measurement m = syntheticCloth("bend-weft", truth, smallReplica());
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 5e-5);
  for (MeasurementFrame& frame : m.frames)
    for (double& x : frame.positions.reshaped()) x += noise(random);
  auto test = make(m, model, smallReplica());
  test->setParameters(truth);
  Eigen::VectorXd r;
  for (int f = 0; f < test->frameCount(); ++f) test->evaluate(f, r, nullptr);
  test->accept();
  EXPECT_FALSE(test->updateDiscrepancy());
  EXPECT_EQ(test->discrepancy_m(), 0.0);
}

TEST(ClothKindFramesTest, BadMeasurementsAreRefused) {
  const ClothModel& model = modelNamed("stvk");
  const ParameterSet truth = clothParameters(model);
  Measurement m = syntheticCloth("stretch-weft", truth, smallReplica(), 1);
  Measurement no_clips = m;
  no_clips.frames[0].clips.clear();
  EXPECT_FALSE(makeFitTest(no_clips, model, smallReplica()).ok());
  Measurement round = m;
  round.rest->positions.row(2).setLinSpaced(0.0, 0.05);
  round.rest->positions.row(2) = round.rest->positions.row(2).cwiseAbs2() * 400.0;
  EXPECT_FALSE(makeFitTest(round, model, smallReplica()).ok());
  Measurement empty = m;
  empty.frames.clear();
  EXPECT_FALSE(makeFitTest(empty, model, smallReplica()).ok());
}

/// The reduced residuals against the direct sum over all vertices, some of them unseen, with
/// unequal sigmas.
TEST(PositionResidualsTest, ReductionIsExact) {
  constexpr double kRounding = 1e-9;  // relative; the ridge is 1e-11
  std::mt19937 random(17);
  std::normal_distribution<double> normal;
  const GridLines lines{linesThrough(0.0, 0.1, 9, {}), linesThrough(0.0, 0.1, 7, {0.022}),
                        DiagonalPattern::kAlternating};
  const SheetMesh sheet = gridSheet(lines);
  const SheetMesh tracked = gridSheet({0.1, 0.1}, 23, 21, DiagonalPattern::kUniform);
  const Interpolation p = interpolation(lines, tracked.rest.uv);
  Points3 y = tracked.rest.positions;
  Eigen::VectorXd sigma(y.cols());
  std::vector<std::uint8_t> valid(y.cols(), 1);
  for (Eigen::Index v = 0; v < y.cols(); ++v) {
    y.col(v) += 5e-5 * Vec3(normal(random), normal(random), normal(random));
    sigma[v] = 5e-5 * (1.0 + 0.5 * std::abs(normal(random)));
    // A corner of several cells that nothing sees, and scattered holes.
    if (tracked.rest.uv.col(v).maxCoeff() < 0.04 || v % 11 == 0) valid[v] = 0;
  }
  const TrackedFrame frame{y, sigma, valid};
  const PositionResiduals reduction(p, frame, sheet.rest.positions, nullptr);
  for (int trial = 0; trial < 5; ++trial) {
    Points3 x = sheet.rest.positions;
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] += 1e-4 * normal(random);
    double direct = 0.0;
    const Eigen::MatrixX3d error = p * x.transpose() - y.transpose();
    for (Eigen::Index v = 0; v < y.cols(); ++v)
      if (valid[v]) direct += error.row(v).squaredNorm() / (sigma[v] * sigma[v]);
    const double reduced = reduction.residuals(x).squaredNorm() + reduction.constant();
    EXPECT_NEAR(reduced, direct, kRounding * direct);
  }
  EXPECT_LT(reduction.size(), 3 * sheet.nodeCount());
  EXPECT_GT(reduction.constantCount(), 0);
}

/// With errors common to all nodes the residuals' squares are r^T (I + E E^T)^-1 r.
TEST(PositionResidualsTest, CommonErrorsAreWhitened) {
  const GridLines lines{linesThrough(0.0, 0.1, 6, {}), linesThrough(0.0, 0.1, 6, {}),
                        DiagonalPattern::kUniform};
  const SheetMesh sheet = gridSheet(lines);
  const SheetMesh tracked = gridSheet({0.1, 0.1}, 12, 12, DiagonalPattern::kUniform);
  const Interpolation p = interpolation(lines, tracked.rest.uv);
  const Points3 y = tracked.rest.positions;
  const Eigen::VectorXd sigma = Eigen::VectorXd::Constant(y.cols(), 1e-4);
  PositionResiduals reduction(p, {y, sigma, {}}, sheet.rest.positions, nullptr);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const Eigen::MatrixXd modes =
      Eigen::MatrixXd::NullaryExpr(3 * sheet.nodeCount(), 4, [&] { return 1e-4 * normal(random); });
  Points3 x = sheet.rest.positions;
  for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] += 1e-4 * normal(random);
  const Eigen::VectorXd plain = reduction.residuals(x);
  const Eigen::MatrixXd e = reduction.derivative(modes);
  reduction.setCommonErrors(modes);
  const Eigen::MatrixXd covariance =
      Eigen::MatrixXd::Identity(plain.size(), plain.size()) + e * e.transpose();
  const double expected = plain.dot(covariance.ldlt().solve(plain));
  EXPECT_LT(expected, 0.999 * plain.squaredNorm());
  EXPECT_NEAR(reduction.residuals(x).squaredNorm(), expected, 1e-9 * expected);
}

}  // namespace
}  // namespace tenter
