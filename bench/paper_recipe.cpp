// SPDX-License-Identifier: GPL-3.0-or-later
// [Est12]'s own recipe beside ours on the same synthetic measurements: what each costs.
#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "fit_roles.h"
#include "frame_evaluator.h"
#include "initial_guess.h"
#include "paper_inner_loop.h"
#include "tenter/fitting/fit.h"
#include "tenter/twin/capture.h"

namespace tenter::bench {
namespace {

constexpr double kImprovement = 0.01;  // [Est12] sec. 5.1: the rule that ends the outer loop.
constexpr int kMaxOuterIterations = 30;
constexpr int kMaxHalvings = 10;

struct Arguments {
  std::string fabric = "knit-12", model = "stvk";
  int frames = 6, nodes = 25, threads = 2, specimen_nodes = 50;
  std::uint64_t seed = 1;
};

Result<std::vector<Measurement>> capture(const Arguments& arguments) {
  std::vector<Measurement> measurements;
  for (const char* protocol : {"stretch-weft", "stretch-warp", "shear", "bend-weft", "bend-warp"}) {
    CaptureOptions options;
    options.fabric = arguments.fabric;
    options.protocol = protocol;
    options.seed = arguments.seed;
    options.nodes = arguments.specimen_nodes;
    options.frames = arguments.frames;
    auto captured = captureMeasurement(options);
    if (!captured.ok()) return captured.error();
    captured->measurement.name = protocol;
    measurements.push_back(std::move(captured->measurement));
  }
  return measurements;
}

/// Gauss-Newton with line search ([Est12] eq. 9) until the residual falls by less than 1 %.
void gaussNewton(FrameEvaluator& evaluator, Eigen::VectorXd& z, int& iterations) {
  if (!evaluator.evaluate(z, false)) return;
  for (int i = 0; i < kMaxOuterIterations; ++i) {
    const double cost = evaluator.cost();
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(z.size(), z.size());
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(z.size());
    for (const FrameBlock& block : evaluator.blocks()) {
      normal += block.jacobian.transpose() * block.jacobian;
      gradient += block.jacobian.transpose() * block.residuals;
    }
    // Coefficients that no frame sees would make the matrix singular.
    normal.diagonal().array() += 1e-6;
    const Eigen::VectorXd step = -normal.ldlt().solve(gradient);
    const Eigen::VectorXd lower = evaluator.space().lowerBounds();
    double share = 1.0;
    bool better = false;
    for (int h = 0; h < kMaxHalvings && !better; ++h, share *= 0.5) {
      const Eigen::VectorXd trial = z + share * step;
      if ((trial.array() < lower.array()).any() || !evaluator.evaluate(trial)) continue;
      better = evaluator.cost() < cost;
      if (better) z = trial;
    }
    ++iterations;
    if (!better || evaluator.cost() > (1.0 - kImprovement) * cost) return;
  }
}

/// The schedule of sec. 5.2 with the knots that our fit ended with (the paper's own search for
/// their number would only add to it).
struct PaperFit {
  FitState state;
  int iterations = 0;
};

void fitGroups(PaperFit& fit, std::vector<FitTest*> tests, const std::vector<int>& chosen,
               const std::vector<int>& groups, int threads) {
  for (const int g : groups) fit.state.updateReference(g);
  FrameEvaluator evaluator(std::move(tests), threads, nullptr);
  const auto space = std::make_shared<FitSpace>(fit.state, groups);
  std::vector<FrameId> frames;
  for (const int t : chosen)
    for (int f = 0; f < evaluator.tests()[t]->frameCount(); ++f) frames.push_back({t, f});
  evaluator.configure(space, frames);
  Eigen::VectorXd z = space->start();
  evaluator.dropFailing(z);
  gaussNewton(evaluator, z, fit.iterations);
  fit.state = space->stateAt(z);
}

Result<int> runPaper(const std::vector<Measurement>& measurements, const ClothModel& model,
                     const FitTestOptions& options, const Material& ours, int threads,
                     PaperCounts& counts) {
  std::vector<std::unique_ptr<FitTest>> owned;
  std::vector<FitTest*> tests;
  std::vector<const Measurement*> pointers;
  std::vector<TestRole> roles;
  for (const Measurement& m : measurements) {
    auto judge = makeFitTest(m, model, options);
    if (!judge.ok()) return judge.error();
    auto test = makePaperTest(m, model, options, std::move(*judge), counts);
    if (!test.ok()) return test.error();
    owned.push_back(std::move(*test));
    tests.push_back(owned.back().get());
    pointers.push_back(&m);
    roles.push_back(testRole(*tests.back(), model));
  }
  PaperFit fit{.state = makeFitState(model, {})};
  setInitialGuesses(fit.state, pointers, roles);
  std::vector<int> all(tests.size());
  for (std::size_t t = 0; t < all.size(); ++t) all[t] = static_cast<int>(t);
  for (const int g : stageOrder(fit.state, roles)) {
    const std::vector<int> chosen = testsOfGroup(fit.state, g, roles);
    fitGroups(fit, tests, chosen, {g}, threads);
    fit.state.setKnots(g, ours.find(fit.state.groupName(g))->curve.strains());
    fitGroups(fit, tests, chosen, {g}, threads);
    std::printf("  %-14s %8ld equilibria %10.1f s\n", fit.state.groupName(g).c_str(),
                counts.equilibria.load(), counts.seconds.load() / threads);
    std::fflush(stdout);
  }
  fitGroups(fit, tests, all, seenGroups(fit.state, roles), threads);
  return fit.iterations;
}

int run(const Arguments& arguments) {
  const auto measurements = capture(arguments);
  if (!measurements.ok()) {
    std::fprintf(stderr, "%s\n", measurements.error().message().c_str());
    return 1;
  }
  FitOptions options;
  options.model = arguments.model;
  options.threads = arguments.threads;
  options.test.nodes = arguments.nodes;
  options.law_uncertainty = false;
  const auto ours = fitMaterial(*measurements, options);
  if (!ours.ok()) {
    std::fprintf(stderr, "%s\n", ours.error().message().c_str());
    return 1;
  }
  std::printf("%s, %d frames x 5, %d nodes a side, %d threads\n", arguments.fabric.c_str(),
              arguments.frames, arguments.nodes, arguments.threads);
  const long equilibria = ours->material.fit["equilibria"].get<long>();
  std::printf(
      "ours:  %8.1f s, %d outer iterations, %ld equilibria, %ld Newton steps, %ld factorizations\n",
      ours->seconds, ours->outer_iterations, equilibria, ours->newton_steps, ours->factorizations);
  PaperCounts counts;
  const ClothModel* model = *findClothModel(arguments.model);
  const auto iterations =
      runPaper(*measurements, *model, options.test, ours->material, arguments.threads, counts);
  if (!iterations.ok()) {
    std::fprintf(stderr, "%s\n", iterations.error().message().c_str());
    return 1;
  }
  const double seconds = counts.seconds / arguments.threads;
  std::printf(
      "paper: %8.1f s, %d outer iterations, %ld equilibria (%ld not converged), %ld damped steps, "
      "%ld "
      "conjugate-gradient steps\n",
      seconds, *iterations, counts.equilibria.load(), counts.unconverged.load(),
      counts.steps.load(), counts.gradient_steps.load());
  std::printf("ratio: %.1f\n", seconds / ours->seconds);
  return 0;
}

}  // namespace
}  // namespace tenter::bench

int main(int argc, char** argv) {
  tenter::bench::Arguments arguments;
  CLI::App app("The recipe of [Est12] sec. 5 and ours on the same virtual measurements");
  app.add_option("--fabric", arguments.fabric)->capture_default_str();
  app.add_option("--model", arguments.model)->capture_default_str();
  app.add_option("--frames", arguments.frames, "of each measurement")->capture_default_str();
  app.add_option("--nodes", arguments.nodes, "a side of the replica")->capture_default_str();
  app.add_option("--specimen-nodes", arguments.specimen_nodes)->capture_default_str();
  app.add_option("--threads", arguments.threads)->capture_default_str();
  app.add_option("--seed", arguments.seed)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return tenter::bench::run(arguments);
}
