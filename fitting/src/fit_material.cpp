// SPDX-License-Identifier: GPL-3.0-or-later
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fit_output.h"
#include "fit_residuals.h"
#include "fit_run.h"
#include "fit_statistics.h"
#include "fit_tests.h"
#include "law_alternatives.h"

namespace tenter {
namespace {

/// Of a fit that was stopped, bands and residuals each get no longer than this: on a fine replica
/// they take the better part of an hour.
constexpr std::chrono::seconds kStoppedFitFinishes{10};

std::function<bool()> after(std::chrono::seconds patience) {
  return [end = std::chrono::steady_clock::now() + patience] {
    return std::chrono::steady_clock::now() >= end;
  };
}

Result<const ClothModel*> modelFor(const FitOptions& options) {
  Result<const ClothModel*> model = findClothModel(options.model);
  if (!model.ok()) return model.error();
  if (!(*model)->fittable)
    return usageError(std::string("the model '").append(options.model).append("' cannot be fitted"),
                      "springs, soft and stvk can");
  return model;
}

Result<void> checkTogether(const std::vector<Measurement>& measurements) {
  if (measurements.empty()) return usageError("a fit needs at least one measurement");
  const Measurement& first = measurements.front();
  for (const Measurement& m : measurements)
    if (m.fabric != first.fabric)
      return badInput(m.name, "fabric",
                      std::string("is '")
                          .append(m.fabric)
                          .append("', but that of ")
                          .append(first.name)
                          .append(" is '")
                          .append(first.fabric)
                          .append("'"),
                      "fit one fabric at a time");
  return {};
}

/// The frames that a test is judged by: all; of a fit that was stopped only the few that brought
/// the tests to its point, and of these as many as there is time for.
std::vector<FramePrediction> judgedFrames(const FrameEvaluator& evaluator, int test,
                                          bool cancelled) {
  if (!cancelled) return predictFrames(*evaluator.tests()[test], false, evaluator.threads());
  std::vector<int> chosen;
  for (const FrameId& id : evaluator.frames())
    if (id.test == test) chosen.push_back(id.frame);
  std::vector<std::optional<FramePrediction>> predictions(chosen.size());
  parallelFor(
      static_cast<int>(chosen.size()), evaluator.threads(),
      [&](int i) { predictions[i] = evaluator.tests()[test]->predict(chosen[i], false); },
      [&] { return evaluator.cancelled(); });
  std::vector<FramePrediction> frames;
  for (std::optional<FramePrediction>& prediction : predictions)
    if (prediction && !prediction->outcome.cancelled) frames.push_back(std::move(*prediction));
  return frames;
}

/// Residuals and shapes of every test with the final parameters.
void judgeTests(FitRun& run, const FitStatistics* statistics, FitResult& result) {
  const std::vector<FitTest*>& tests = run.evaluator().tests();
  const int threads = run.evaluator().threads();
  if (result.cancelled) run.evaluator().cancelWhen(after(kStoppedFitFinishes));
  for (std::size_t t = 0; t < tests.size(); ++t) {
    TestResidual residual = summarizeTest(
        *tests[t], judgedFrames(run.evaluator(), static_cast<int>(t), result.cancelled));
    if (statistics) residual.chi2_per_dof = statistics->tests[t].chi2_per_dof;
    residual.discrepancy_m = tests[t]->discrepancy_m();
    if (!result.cancelled) residual.multistable_frames = countMultistable(*tests[t], threads);
    if (residual.unconverged_frames > 0)
      result.warnings.push_back(std::to_string(residual.unconverged_frames)
                                    .append(" frames of ")
                                    .append(residual.measurement)
                                    .append(" have no equilibrium with the fitted material"));
    if (residual.multistable_frames > 0)
      result.warnings.push_back(std::to_string(residual.multistable_frames)
                                    .append(" frames of ")
                                    .append(residual.measurement)
                                    .append(" have several stable shapes"));
    result.tests.push_back(std::move(residual));
  }
}

nlohmann::json fitJson(FitRun& run, const FitResult& result, const FitStatistics* statistics,
                       const Eigen::VectorXd& z) {
  nlohmann::json json = {{"converged", result.converged},
                         {"cancelled", result.cancelled},
                         {"outer_iterations", run.outer_iterations},
                         {"equilibria", run.evaluator().counts().evaluations},
                         {"rejected_points", run.evaluator().counts().failures},
                         {"tests", nlohmann::json::array()},
                         {"assumptions", assumptionsJson(run.state(), run.refinedGroups())},
                         {"warnings", result.warnings}};
  for (const TestResidual& test : result.tests) json["tests"].push_back(toJson(test));
  if (!statistics) return json;
  json["identifiability"] = identifiabilityJson(run.evaluator().space(), *statistics);
  json["specimens"] = specimenJson(run.evaluator(), *statistics, z);
  return json;
}

void finish(FitRun& run, const std::vector<Measurement>& measurements, const FitOptions& options,
            const TestFactory& factory, FitResult& result) {
  const bool settled = run.settle();
  const FitSpace space = run.evaluator().space();
  const Eigen::VectorXd z = run.last().z;
  FitStatistics statistics;
  if (settled) statistics = fitStatistics(run.evaluator(), run.blocks(), z);
  const FitStatistics* known = settled ? &statistics : nullptr;
  if (result.cancelled && !settled)
    result.warnings.emplace_back("stopped before it was known how uncertain the curves are");
  result.material = materialOf(run, run.state(), space, known, z, measurements, options);
  judgeTests(run, known, result);
  result.material.fit = fitJson(run, result, known, z);
  SolveCounts counts = run.evaluator().counts();
  if (options.law_uncertainty && settled)
    result.material.fit["law_uncertainty"] =
        lawAlternatives(run, measurements, options, factory, counts);
  result.factorizations = counts.factorizations;
  result.newton_steps = counts.newton_steps;
}

}  // namespace

Result<std::vector<std::unique_ptr<FitTest>>> makeTests(
    const std::vector<Measurement>& measurements, const ClothModel& model,
    const FitTestOptions& options, const TestFactory& factory) {
  std::vector<std::unique_ptr<FitTest>> tests;
  for (const Measurement& m : measurements) {
    auto test = factory(m, model, options);
    if (!test.ok()) return test.error().in(m.name);
    tests.push_back(std::move(test).value());
  }
  return tests;
}

Result<FitResult> fitWithTests(const std::vector<Measurement>& measurements,
                               const FitOptions& options, const TestFactory& factory) {
  const auto begin = std::chrono::steady_clock::now();
  if (const Result<void> fits = checkTogether(measurements); !fits.ok()) return fits.error();
  const Result<const ClothModel*> model = modelFor(options);
  if (!model.ok()) return model.error();
  auto tests = makeTests(measurements, **model, options.test, factory);
  if (!tests.ok()) return tests.error();
  std::vector<FitTest*> pointers;
  for (const auto& test : *tests) pointers.push_back(test.get());

  FitRun run(**model, pointers, options);
  FitResult result;
  const bool ran = run.run();
  // From here on the answer is completed whatever happens, of a fit that was stopped as far as that
  // is soon done.
  result.cancelled = run.evaluator().cancelled();
  run.evaluator().cancelWhen(result.cancelled ? after(kStoppedFitFinishes)
                                              : std::function<bool()>());
  if (result.cancelled && !run.last().usable)
    return notConverged("stopped before anything was fitted; nothing was written");
  if (!ran && !run.last().usable)
    return notConverged("no frame of any measurement has a stable equilibrium near the first guess",
                        "check units, clips and areal density of the measurements");
  result.converged = ran && run.converged && !result.cancelled;
  result.warnings = run.warnings;
  FitOptions final_options = options;
  if (result.cancelled) final_options.law_uncertainty = false;
  if (result.cancelled) final_options.cancelled = nullptr;
  finish(run, measurements, final_options, factory, result);
  result.outer_iterations = run.outer_iterations;
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

Result<FitResult> fitMaterial(const std::vector<Measurement>& measurements,
                              const FitOptions& options) {
  return fitWithTests(
      measurements, options,
      [](const Measurement& m, const ClothModel& model, const FitTestOptions& test) {
        return makeFitTest(borrowed(m), model, test);
      });
}

}  // namespace tenter
