// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>

#include "fit_residuals.h"
#include "fit_tests.h"
#include "frame_evaluator.h"
#include "law_band.h"

namespace tenter {
namespace {

/// Half-width of a 95 % band over its standard deviation.
constexpr double kBand = 1.96;

/// A material that is ready to predict.
struct Predictor {
  const ClothModel* model = nullptr;
  std::optional<ParameterSet> parameters;
  ClothLaws laws;
  Eigen::MatrixXd covariance;  ///< Of all coefficients; empty if not known.

  void apply(FitTest& test) const {
    if (parameters)
      test.setParameters(*parameters);
    else
      test.setLaws(laws);
  }
};

Result<Predictor> predictorOf(const Material& material) {
  const Result<const ClothModel*> model = findClothModel(material.law);
  if (!model)
    return badInput("", "law", "is " + material.law + ", with which nothing can be predicted",
                    model.error().advice);
  Predictor predictor;
  predictor.model = *model;
  Result<std::optional<ParameterSet>> parameters = parametersOf(material, **model);
  if (!parameters) return parameters.error();
  predictor.parameters = std::move(*parameters);
  if (predictor.parameters)
    predictor.covariance = coefficientCovariance(material, *predictor.parameters);
  Result<ClothLaws> laws = makeLaws(**model, material);
  if (!laws) return laws.error();
  predictor.laws = std::move(*laws);
  return predictor;
}

double chi2PerNumber(FitTest& test, int threads) {
  std::vector<double> squares(test.frameCount(), 0.0);
  parallelFor(test.frameCount(), threads, [&](int frame) {
    Eigen::VectorXd residuals;
    test.evaluate(frame, residuals, nullptr);
    squares[frame] = residuals.squaredNorm();
  });
  double sum = test.constantCost(), count = test.constantCount();
  for (int frame = 0; frame < test.frameCount(); ++frame) {
    sum += squares[frame];
    count += test.residualCount(frame);
  }
  return count > 0.0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

/// Variance of each frame's summary from the parameters.
std::vector<double> parameterVariance(const std::vector<FramePrediction>& frames,
                                      const Eigen::MatrixXd& covariance) {
  std::vector<double> variance(frames.size(), 0.0);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const Eigen::VectorXd& d = frames[f].summary_by_parameter;
    if (d.size() == covariance.rows() && d.size() > 0)
      variance[f] = std::max(0.0, d.dot(covariance * d));
  }
  return variance;
}

/// Variance of each frame's summary from the choice of the law: the largest difference to a law
/// that met the same data about as well counts as one standard deviation, and so does what the fit
/// itself left on comparable tests.
Result<std::vector<double>> lawVariance(const std::vector<FramePrediction>& frames,
                                        const Measurement& m,
                                        const std::vector<Predictor>& alternatives,
                                        double relative_residual,
                                        const EvaluationOptions& options) {
  double largest = 0.0;
  for (const FramePrediction& frame : frames)
    largest = std::max(largest, std::abs(frame.summary_predicted));
  std::vector<double> difference(frames.size(), 0.0);
  for (const Predictor& alternative : alternatives) {
    Result<std::unique_ptr<FitTest>> test =
        makeFitTest(borrowed(m), *alternative.model, options.test);
    if (!test) return test.error();
    alternative.apply(**test);
    const std::vector<FramePrediction> other = predictFrames(**test, false, options.threads);
    for (std::size_t f = 0; f < frames.size(); ++f)
      if (other[f].outcome.converged)
        difference[f] = std::max(
            difference[f], std::abs(other[f].summary_predicted - frames[f].summary_predicted));
  }
  std::vector<double> variance(frames.size());
  for (std::size_t f = 0; f < frames.size(); ++f)
    variance[f] = difference[f] * difference[f] + std::pow(relative_residual * largest, 2);
  return variance;
}

void fillBands(const std::vector<FramePrediction>& frames, const std::vector<double>& parameters,
               const std::vector<double>& law, EvaluatedTest& evaluated) {
  int inside = 0, counted = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const double noise = frames[f].summary_sigma * frames[f].summary_sigma;
    evaluated.band_parameters.push_back(kBand * std::sqrt(parameters[f]));
    evaluated.band_law.push_back(kBand * std::sqrt(law[f]));
    evaluated.band_total.push_back(kBand * std::sqrt(parameters[f] + law[f] + noise));
    if (!frames[f].outcome.converged) continue;
    ++counted;
    if (std::abs(frames[f].summary_predicted - frames[f].summary_measured) <=
        evaluated.band_total.back())
      ++inside;
  }
  if (counted > 0) evaluated.coverage = static_cast<double>(inside) / counted;
}

bool hasForces(const std::vector<FramePrediction>& frames) {
  return std::any_of(frames.begin(), frames.end(), [](const FramePrediction& frame) {
    return frame.predicted_force_N.size() > 0;
  });
}

Result<EvaluatedTest> evaluateOne(const Material& material, const Predictor& predictor,
                                  const std::vector<Predictor>& alternatives, const Measurement& m,
                                  const EvaluationOptions& options) {
  Result<std::unique_ptr<FitTest>> test = makeFitTest(borrowed(m), *predictor.model, options.test);
  if (!test) return test.error();
  predictor.apply(**test);
  const bool with_derivatives = predictor.covariance.size() > 0;
  std::vector<FramePrediction> frames = predictFrames(**test, with_derivatives, options.threads);
  EvaluatedTest evaluated;
  evaluated.residual = summarizeTest(**test, frames);
  evaluated.residual.chi2_per_dof = chi2PerNumber(**test, options.threads);
  evaluated.coverage = std::numeric_limits<double>::quiet_NaN();
  const double relative_residual = comparableResidual(material, m.protocol);
  const bool known = with_derivatives || !alternatives.empty() || relative_residual > 0.0;
  if (known && hasForces(frames)) {
    const Result<std::vector<double>> law =
        lawVariance(frames, m, alternatives, relative_residual, options);
    if (!law) return law.error();
    fillBands(frames, parameterVariance(frames, predictor.covariance), *law, evaluated);
  }
  if (options.predictions) evaluated.frames = std::move(frames);
  return evaluated;
}

}  // namespace

Result<std::vector<EvaluatedTest>> evaluateMaterial(const Material& material,
                                                    const std::vector<Measurement>& measurements,
                                                    const EvaluationOptions& options) {
  const Result<Predictor> predictor = predictorOf(material);
  if (!predictor) return predictor.error();
  const Result<std::vector<Material>> laws = alternativeLaws(material);
  if (!laws) return laws.error();
  std::vector<Predictor> alternatives;
  for (const Material& law : *laws) {
    Result<Predictor> alternative = predictorOf(law);
    if (!alternative) return alternative.error();
    alternatives.push_back(std::move(*alternative));
  }
  std::vector<EvaluatedTest> tests;
  for (const Measurement& m : measurements) {
    Result<EvaluatedTest> test = evaluateOne(material, *predictor, alternatives, m, options);
    if (!test) return test.error();
    tests.push_back(std::move(*test));
  }
  return tests;
}

}  // namespace tenter
