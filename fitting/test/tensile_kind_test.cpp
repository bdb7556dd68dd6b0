// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <numbers>

#include "kind_fixtures.h"
#include "strip_sheet.h"
#include "tenter/core/files.h"
#include "tenter/mechanics/equilibrium.h"
#include "tenter/test_support/data.h"

namespace tenter {
namespace {

using kinds::clothParameters;
using kinds::constantCurve;
using kinds::jacobianError;
using kinds::modelNamed;
using kinds::onlyFree;

Measurement strip(double angle_deg, const std::vector<double>& displacements_m,
                  double width_m = 0.02) {
  Measurement m;
  m.name = "strip";
  m.protocol = "tensile";
  m.areal_density_kg_per_m2 = 0.1;
  m.tensile = TensileSetup{};
  m.tensile->length_m = 0.1;
  m.tensile->width_m = width_m;
  m.tensile->strips = 3;
  m.tensile->angle_rad = angle_deg * std::numbers::pi / 180.0;
  for (const double d : displacements_m) {
    MeasurementFrame frame;
    frame.displacement_m = d;
    frame.force_N = 1e3 * d;
    frame.force_sigma_N = 0.01;
    m.frames.push_back(frame);
  }
  return m;
}

std::unique_ptr<FitTest> make(const Measurement& m, const ClothModel& model) {
  FitTestOptions options;
  options.equilibrium_tolerance_N = 1e-12;  // so that differences of forces are meant
  auto test = makeFitTest(m, model, options);
  EXPECT_TRUE(test.ok()) << (test.ok() ? "" : test.error().message());
  return std::move(*test);
}

double predictedForce(FitTest& test, int frame) {
  const FramePrediction p = test.predict(frame, false);
  EXPECT_TRUE(p.outcome.converged && p.outcome.stable) << p.outcome.problem;
  return p.predicted_force_N[0];
}

/// Width times dW/dlambda of a strip that no coupling contracts, lambda the stretch ratio.
double uniaxialForce(const ClothModel& model, const StiffnessCurve& curve, double lambda,
                     double width) {
  const bool green = model.membrane == MembraneElement::kStvk;
  const double strain = green ? 0.5 * (lambda * lambda - 1.0) : lambda - 1.0;
  return width * curve.evaluate(strain).stress * (green ? lambda : 1.0);
}

TEST(TensileKindTest, StripAlongAYarnHasTheUniaxialForce) {
  // Only the equilibrium's tolerance separates a uniform state from its closed form.
  constexpr double kClosedForm = 1e-6;
  for (const char* id : {"stvk", "soft"}) {
    const ClothModel& model = modelNamed(id);
    const ParameterSet parameters = clothParameters(model);
    for (const int yarn : {0, 1}) {
      auto test = make(strip(90.0 * yarn, {0.001, 0.004}), model);
      test->setParameters(parameters);
      for (const int frame : {0, 1}) {
        const double lambda = 1.0 + test->measurement().frames[frame].displacement_m / 0.1;
        const double expected =
            3 * uniaxialForce(model, parameters.components[yarn].curve, lambda, 0.02);
        EXPECT_NEAR(predictedForce(*test, frame), expected, kClosedForm * expected)
            << id << " yarn " << yarn;
      }
    }
  }
}

TEST(TensileKindTest, StretchBeforeTheFirstRowCounts) {
  const ClothModel& model = modelNamed("stvk");
  Measurement m = strip(0.0, {0.002});
  m.tensile->length_m = 0.101;
  m.tensile->zero_offset_m = 0.001;  // 0.1 m at rest, 0.103 m now
  auto test = make(m, model);
  const ParameterSet parameters = clothParameters(model);
  test->setParameters(parameters);
  const double expected = 3 * uniaxialForce(model, parameters.components[0].curve, 1.03, 0.02);
  EXPECT_NEAR(predictedForce(*test, 0), expected, 1e-6 * expected);
}

TEST(TensileKindTest, JacobianMatchesFiniteDifferences) {
  for (const char* id : {"stvk", "soft", "stvk-coupled", "springs"}) {
    const ClothModel& model = modelNamed(id);
    for (const double angle_deg : {0.0, 90.0, 30.0}) {
      if (model.needs_grid && angle_deg == 30.0) continue;
      auto test = make(strip(angle_deg, {0.001, 0.003}), model);
      for (const int frame : {0, 1})
        EXPECT_LT(jacobianError(*test, onlyFree(clothParameters(model), false), frame),
                  kinds::kJacobianTolerance)
            << id << " at " << angle_deg;
    }
  }
}

/// Force of a strip at 45 degrees on a mesh of the given nodes across.
double meshedForce(const ParameterSet& set, double length, double width, int across,
                   double stretch) {
  const int along = static_cast<int>(std::lround(length / width * (across - 1)));
  StripSheet strip = makeStrip(*set.model, equalLines(0.0, length, along),
                               equalLines(-0.5 * width, 0.5 * width, across - 1),
                               0.25 * std::numbers::pi, DiagonalPattern::kAlternating)
                         .value();
  SystemSetup setup;
  setup.gravity_m_per_s2.setZero();
  setup.areal_density_kg_per_m2 = 0.1;
  setup.planar = true;
  setup.clips.resize(2);
  setup.clips[0].nodes = strip.nodesBetween(0.0, 0.0);
  setup.clips[1].nodes = strip.nodesBetween(length, length);
  const ClothSystem system =
      ClothSystem::create(strip.sheet, *set.model, makeLaws(*set.model, set.components), setup)
          .value();
  ClothState state = system.restState();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = stretch * strip.along;
  system.setClipPose(state, 1, pose);
  EXPECT_TRUE(EquilibriumSolver(system).solve(state).converged());
  return -strip.along.dot(system.clipWrench(state, 1).force_N);
}

TEST(TensileKindTest, MeshIsFineEnough) {
  constexpr double kMeshError = 2e-3;
  const ClothModel& model = modelNamed("stvk");
  ParameterSet parameters = clothParameters(model);
  // As the coated nylon: yarns stiff against shear, so that clamps reach far.
  parameters.components[0] = constantCurve(1.3e4);
  parameters.components[1] = constantCurve(2.7e4);
  parameters.components[2] = constantCurve(4e3);
  for (const double width : {0.0025, 0.01, 0.025}) {
    auto test = make(strip(45.0, {0.002}, width), model);
    test->setParameters(parameters);
    const int finer = width < 0.005 ? 9 : 21;
    const double reference = 3 * meshedForce(parameters, 0.1, width, finer, 0.002);
    EXPECT_NEAR(predictedForce(*test, 0), reference, kMeshError * reference) << "width " << width;
  }
}

TEST(TensileKindTest, SpringsRefuseStripsAcrossTheYarns) {
  const auto test = makeFitTest(strip(45.0, {0.001}), modelNamed("springs"), {});
  ASSERT_FALSE(test.ok());
  EXPECT_NE(test.error().message().find("yarn"), std::string::npos) << test.error().message();
}

TEST(TensileKindTest, ObservesTheYarnItRunsAlong) {
  const ClothModel& model = modelNamed("stvk");
  EXPECT_EQ(make(strip(0.0, {0.001}), model)->observedComponents(model), std::vector<int>{0});
  EXPECT_EQ(make(strip(90.0, {0.001}), model)->observedComponents(model), std::vector<int>{1});
  EXPECT_EQ(make(strip(30.0, {0.001}), model)->observedComponents(model),
            (std::vector<int>{0, 1, 2}));
}

TEST(TensileKindTest, RunsOnRealOffAxisData) {
  for (const auto& [name, angle] : {std::pair{"00", 0.0}, {"45", 45.0}, {"90", 90.0}}) {
    const auto file = test_support::findData(std::string("nylon-offaxis/angle-") + name + ".csv");
    if (!file) GTEST_SKIP() << test_support::noData();
    const Eigen::MatrixXd rows = readNumericTable(*file, 2).value();
    Measurement m = strip(angle, {});
    m.areal_density_kg_per_m2 = 0.0616;
    m.tensile->length_m = 0.097;
    m.tensile->width_m = 0.00225;
    m.tensile->strips = 12;
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      MeasurementFrame frame;
      frame.displacement_m = 1e-3 * rows(i, 0);
      frame.force_N = rows(i, 1);
      m.frames.push_back(frame);
    }
    const ClothModel& model = modelNamed("stvk");
    ParameterSet parameters = clothParameters(model);
    for (int i = 0; i < 3; ++i) parameters.components[i] = constantCurve(2e4);
    auto test = make(m, model);
    test->setParameters(parameters);
    double last = -1.0;
    int steps = 0;
    for (int f = 0; f < test->frameCount(); ++f) {
      const FramePrediction p = test->predict(f, true);
      EXPECT_TRUE(p.outcome.converged && p.outcome.stable)
          << name << " frame " << f << p.outcome.problem;
      EXPECT_GT(p.predicted_force_N[0], last);
      last = p.predicted_force_N[0];
      steps += p.outcome.newton_steps;
    }
    EXPECT_LT(steps, 8 * test->frameCount());
  }
}

}  // namespace
}  // namespace tenter
