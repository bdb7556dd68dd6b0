// SPDX-License-Identifier: GPL-3.0-or-later
// A law makes the data of real tests (strips simulated by the same mechanics), the fit must find it
// again.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tenter/fitting/fit.h"

namespace tenter {
namespace {

constexpr double kDensity_kg_per_m2 = 0.1;
constexpr int kFrames = 16;
constexpr double kLargestStrain = 0.1;
/// What "found again" means: each identifiable stiffness within half a per cent.
constexpr double kRecovered = 0.005;

std::vector<double> trueKnots() { return {0.0, 0.04, 0.08}; }

Measurement stripAt(double angle_deg) {
  Measurement m;
  m.name = std::string("strip ").append(std::to_string(static_cast<int>(angle_deg)));
  m.fabric = "own";
  m.specimen = "1";
  m.protocol = "tensile";
  m.areal_density_kg_per_m2 = kDensity_kg_per_m2;
  m.tensile = TensileSetup{.length_m = 0.1,
                           .width_m = 0.02,
                           .strips = 1,
                           .angle_rad = angle_deg * M_PI / 180.0,
                           .zero_offset_m = 0.0,
                           .zero_strain_rule = "given"};
  for (int i = 1; i <= kFrames; ++i) {
    MeasurementFrame frame;
    frame.time_ns = i;
    frame.displacement_m = kLargestStrain * 0.1 * i / kFrames;
    frame.force_N = 1.0;  // Tests take their force scale from it until measure() knows better.
    m.frames.push_back(frame);
  }
  return m;
}

ParameterSet trueLaw(const ClothModel& model) {
  ParameterSet truth{.model = &model, .components = {}};
  for (int c = 0; c < model.componentCount(); ++c)
    truth.components.push_back({StiffnessCurve::constant(1e-5, model.component(c).even), nullptr});
  const double at_rest[] = {400.0, 900.0, 40.0};
  const double growth[] = {1.5, 0.3, 0.6};
  for (int c = 0; c < 3; ++c) {
    const SplineBasis basis = SplineBasis::onKnots(trueKnots(), model.component(c).even);
    const Eigen::VectorXd shape = Eigen::VectorXd::LinSpaced(basis.size(), 0.0, 1.0);
    truth.components[c].curve =
        basis.curve(at_rest[c] * (growth[c] * shape.array() + 1.0).matrix());
  }
  return truth;
}

void measure(Measurement& m, const ParameterSet& truth) {
  auto test = makeFitTest(m, *truth.model, {});
  ASSERT_TRUE(test.ok()) << test.error().message();
  (*test)->setParameters(truth);
  for (int f = 0; f < kFrames; ++f) {
    const FramePrediction prediction = (*test)->predict(f, false);
    ASSERT_TRUE(prediction.outcome.converged);
    m.frames[f].force_N = prediction.predicted_force_N[0];
  }
}

class Recovery : public testing::TestWithParam<std::string> {};

TEST_P(Recovery, FindsTheLawThatMadeStripsOfThreeAngles) {
  const ClothModel& model = **findClothModel(GetParam());
  const ParameterSet truth = trueLaw(model);
  std::vector<Measurement> strips = {stripAt(0.0), stripAt(90.0), stripAt(45.0)};
  for (Measurement& strip : strips) measure(strip, truth);
  FitOptions options;
  options.model = GetParam();
  options.law_uncertainty = false;
  for (const char* name : {"stretch_weft", "stretch_warp", "shear"})
    options.knots[name] = trueKnots();
  const auto result = fitMaterial(strips, options);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_TRUE(result->converged);
  int observed = 0;
  for (int c = 0; c < 3; ++c) {
    const MaterialComponent* fitted = result->material.find(std::string(model.component(c).name));
    ASSERT_NE(fitted, nullptr);
    for (int k = 0; k < fitted->curve.knotCount(); ++k) {
      if (!fitted->knot_observed[k]) continue;
      ++observed;
      const double strain = fitted->curve.strains()[k];
      const double expected = truth.components[c].curve.evaluate(strain).stiffness;
      EXPECT_NEAR(fitted->curve.stiffnesses()[k] / expected, 1.0, kRecovered)
          << fitted->name << " at " << strain;
    }
  }
  EXPECT_GE(observed, 7) << "of nine knots";
  for (const TestResidual& test : result->tests) EXPECT_LT(test.force_nrmse, 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Triangles, Recovery, testing::Values("stvk", "soft"));

}  // namespace
}  // namespace tenter
