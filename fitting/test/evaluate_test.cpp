// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "cloth_fixture.h"
#include "tenter/fitting/fit.h"

namespace tenter {
namespace {

using kinds::clothParameters;
using kinds::modelNamed;
using kinds::syntheticCloth;

FitTestOptions smallReplica() {
  FitTestOptions options;
  options.nodes = 11;
  return options;
}

Material materialOf(const ParameterSet& set) {
  Material material;
  material.fabric = "synthetic";
  material.law = std::string(set.model->id);
  material.areal_density_kg_per_m2 = 0.15;
  for (std::size_t i = 0; i < set.components.size(); ++i) {
    MaterialComponent component;
    component.name = std::string(set.model->component(static_cast<int>(i)).name);
    component.curve = set.components[i].curve;
    const Eigen::VectorXd coefficients = set.components[i].basis->coefficientsOf(component.curve);
    component.coefficients.assign(coefficients.begin(), coefficients.end());
    material.components.push_back(component);
  }
  return material;
}

std::vector<EvaluatedTest> evaluate(const Material& material, const Measurement& m) {
  EvaluationOptions options;
  options.test = smallReplica();
  options.predictions = true;
  auto tests = evaluateMaterial(material, {m}, options);
  if (!tests) throw std::runtime_error(tests.error().message());
  return *tests;
}

class EvaluateTest : public testing::Test {
 protected:
  ParameterSet truth = clothParameters(modelNamed("stvk"));
  Measurement stretch = syntheticCloth("stretch-weft", truth, smallReplica());
};

TEST_F(EvaluateTest, TruthPredictsItsOwnMeasurement) {
  const EvaluatedTest test = evaluate(materialOf(truth), stretch).front();
  EXPECT_EQ(test.residual.frames, 2);
  EXPECT_LT(test.residual.force_nrmse, 1e-6);
  EXPECT_LT(test.residual.position_rms_m, 1e-7);
  EXPECT_TRUE(std::isnan(test.coverage)) << "nothing is known of its bands";
  EXPECT_TRUE(test.band_total.empty());
}

TEST_F(EvaluateTest, NrmseIsRelativeToTheLargestForce) {
  // All stretch stiffnesses a tenth higher; shear and weight have no part in the axial force worth
  // a per cent.
  ParameterSet stiffer = truth;
  stiffer.setCoefficients(1.1 * truth.coefficients());
  const EvaluatedTest test = evaluate(materialOf(stiffer), stretch).front();
  double largest = 0.0, square = 0.0;
  for (const FramePrediction& frame : test.frames) {
    largest = std::max(largest, std::abs(frame.summary_measured));
    square += std::pow(frame.summary_predicted - frame.summary_measured, 2);
  }
  // Two clips, each with that error, in one vector.
  square *= 2.0 / static_cast<double>(test.frames.size());
  EXPECT_NEAR(test.residual.force_nrmse, std::sqrt(square) / largest,
              0.01 * test.residual.force_nrmse);
  EXPECT_GT(test.residual.force_nrmse, 0.05);
}

TEST_F(EvaluateTest, ParameterBandFollowsTheCovariance) {
  Material material = materialOf(truth);
  // Every weft coefficient errs by the same factor of one per cent, so the force does nearly too.
  const Eigen::VectorXd c = truth.components[0].basis->coefficientsOf(truth.components[0].curve);
  ParameterCovariance covariance;
  for (Eigen::Index j = 0; j < c.size(); ++j)
    covariance.labels.push_back("stretch_weft[" + std::to_string(j) + "]");
  covariance.covariance = 1e-4 * c * c.transpose();
  material.covariance = covariance;
  const EvaluatedTest test = evaluate(material, stretch).front();
  ASSERT_EQ(test.band_parameters.size(), 2u);
  for (std::size_t f = 0; f < 2; ++f) {
    const double expected = 1.96 * 0.01 * std::abs(test.frames[f].summary_predicted);
    EXPECT_NEAR(test.band_parameters[f], expected, 0.02 * expected);
    EXPECT_EQ(test.band_law[f], 0.0);
  }
  EXPECT_EQ(test.coverage, 1.0);
}

TEST_F(EvaluateTest, TiedComponentsShareTheirCovariance) {
  Material material = materialOf(truth);
  material.variant = "isotropic";
  material.components[1].curve = material.components[0].curve;
  material.components[1].coefficients = material.components[0].coefficients;
  const Eigen::VectorXd c = truth.components[0].basis->coefficientsOf(truth.components[0].curve);
  ParameterCovariance covariance;
  for (Eigen::Index j = 0; j < c.size(); ++j)
    covariance.labels.push_back("stretch_weft[" + std::to_string(j) + "]");
  covariance.covariance = 1e-4 * c * c.transpose();
  material.covariance = covariance;
  const EvaluatedTest test =
      evaluate(material, syntheticCloth("stretch-warp", truth, smallReplica())).front();
  const double expected = 1.96 * 0.01 * std::abs(test.frames[1].summary_predicted);
  EXPECT_NEAR(test.band_parameters[1], expected, 0.02 * expected);
}

TEST_F(EvaluateTest, LawBandIsTheDifferenceToTheAlternative) {
  Material material = materialOf(truth);
  ParameterSet other = clothParameters(modelNamed("stvk-coupled"));
  material.fit = {{"law_uncertainty",
                   {{"alternatives",
                     {{{"name", "coupled"}, {"material", materialToJson(materialOf(other))}}}}}},
                  {"tests", {{{"protocol", "stretch-weft"}, {"force_nrmse", 0.02}}}}};
  const EvaluatedTest test = evaluate(material, stretch).front();
  const EvaluatedTest alternative = evaluate(materialOf(other), stretch).front();
  ASSERT_EQ(test.band_law.size(), 2u);
  const double peak = std::max(std::abs(test.frames[0].summary_predicted),
                               std::abs(test.frames[1].summary_predicted));
  for (std::size_t f = 0; f < 2; ++f) {
    const double difference =
        alternative.frames[f].summary_predicted - test.frames[f].summary_predicted;
    EXPECT_NEAR(test.band_law[f], 1.96 * std::hypot(difference, 0.02 * peak),
                1e-6 * test.band_law[f]);
    EXPECT_GT(std::abs(difference), 0.0);
  }
}

TEST_F(EvaluateTest, BadMaterialsAreRefused) {
  EvaluationOptions options;
  Material unknown = materialOf(truth);
  unknown.law = "velvet";
  ASSERT_FALSE(evaluateMaterial(unknown, {stretch}, options).ok());
  EXPECT_EQ(evaluateMaterial(unknown, {stretch}, options).error().kind, ErrorKind::kBadInput);
  Material incomplete = materialOf(truth);
  incomplete.components.pop_back();
  EXPECT_FALSE(evaluateMaterial(incomplete, {stretch}, options).ok());
  Material wrong = materialOf(truth);
  wrong.components[0].coefficients.pop_back();
  EXPECT_FALSE(evaluateMaterial(wrong, {stretch}, options).ok());
}

}  // namespace
}  // namespace tenter
