// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "tenter/fitting/fit_test.h"

namespace tenter {

/// How one frame of a fake test is strained, and what was measured.
struct FakeFrame {
  std::vector<int> components;
  double travel = 0.0;      ///< Strain of the component and of a known spring in series with it.
  double measured_N = 0.0;  ///< Sum of the components' forces.
  double sigma_N = 1.0;
};

/// A measurement whose equilibrium is one equation: each component in series with a spring, e +
/// sigma(e) / K = travel, force = sum of sigma(e). It has what makes the outer loop hard (an inner
/// solve, derivatives by the implicit function theorem, points without equilibrium) and costs
/// microseconds.
class FakeTest final : public FitTest {
 public:
  FakeTest(Measurement measurement, std::vector<FakeFrame> frames, double series_N)
      : measurement_(std::move(measurement)), frames_(std::move(frames)), series_(series_N) {}

  std::function<bool(double force)> breaks;  ///< Frames have no equilibrium where this says so.

  const Measurement& measurement() const override { return measurement_; }
  int frameCount() const override { return static_cast<int>(frames_.size()); }
  int residualCount(int) const override { return 1; }
  std::vector<int> observedComponents(const ClothModel&) const override {
    return frames_.front().components;
  }
  void setParameters(const ParameterSet& parameters) override { parameters_ = parameters; }
  void accept() override {}
  void restart() override {}

  FrameOutcome evaluate(int index, Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian) override {
    const FakeFrame& frame = frames_[index];
    const double f = force(frame);
    residuals = Eigen::VectorXd::Constant(1, (f - frame.measured_N) / frame.sigma_N);
    if (jacobian) *jacobian = forceByParameter(frame) / frame.sigma_N;
    FrameOutcome outcome;
    outcome.converged = outcome.stable = !(breaks && breaks(f));
    outcome.newton_steps = outcome.factorizations = 1;
    return outcome;
  }

  FramePrediction predict(int index, bool) override {
    const FakeFrame& frame = frames_[index];
    FramePrediction prediction;
    prediction.displacement = frame.travel;
    prediction.measured_force_N = Eigen::VectorXd::Constant(1, frame.measured_N);
    prediction.predicted_force_N = Eigen::VectorXd::Constant(1, force(frame));
    prediction.position_rms_m = std::numeric_limits<double>::quiet_NaN();
    prediction.outcome.converged = prediction.outcome.stable = true;
    return prediction;
  }

  StrainSamples strainSamples(int component) const override {
    StrainSamples samples;
    for (const FakeFrame& frame : frames_) {
      if (std::ranges::find(frame.components, component) == frame.components.end()) continue;
      samples.strain.push_back(strainAt(component, frame.travel));
      samples.weight.push_back(1.0);
    }
    return samples;
  }

  double force(const FakeFrame& frame) const {
    double sum = 0.0;
    for (const int c : frame.components) {
      const double e = strainAt(c, frame.travel);
      sum += parameters_.components[c].curve.evaluate(e).stress;
    }
    return sum;
  }

 private:
  /// Newton on e + sigma(e) / K = travel, which is monotone for the curves used here.
  double strainAt(int component, double travel) const {
    if (parameters_.components.empty()) return travel;
    double e = travel;
    for (int i = 0; i < 50; ++i) {
      const CurveValue value = parameters_.components[component].curve.evaluate(e);
      e -= (e + value.stress / series_ - travel) / (1.0 + value.tangent / series_);
    }
    return e;
  }

  Eigen::MatrixXd forceByParameter(const FakeFrame& frame) const {
    Eigen::MatrixXd row = Eigen::MatrixXd::Zero(1, parameters_.size());
    for (const int c : frame.components) {
      const ComponentCurve& component = parameters_.components[c];
      if (!component.basis) continue;
      const double e = strainAt(c, frame.travel);
      const double tangent = component.curve.evaluate(e).tangent;
      Eigen::VectorXd values(component.basis->size());
      component.basis->evaluate(e, values);
      // d sigma = N e dc + sigma' de and de = -d sigma / K.
      row.middleCols(parameters_.offset(c), values.size()) +=
          (values * e / (1.0 + tangent / series_)).transpose();
    }
    return row;
  }

  Measurement measurement_;
  std::vector<FakeFrame> frames_;
  double series_;
  ParameterSet parameters_;
};

}  // namespace tenter
