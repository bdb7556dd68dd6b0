// SPDX-License-Identifier: GPL-3.0-or-later
// [Est12]'s own recipe beside ours on the same synthetic measurements: what each costs at the same
// task, once with the same knots given to both and once when both search for their own.
#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "fit_roles.h"
#include "fit_run.h"
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
constexpr int kMaxControlPoints = 5;  // Sec. 5.2: "usually 4 or 5".

struct Arguments {
  std::string fabric = "knit-12", model = "stvk";
  int frames = 6, nodes = 25, threads = 2, specimen_nodes = 50;
  std::uint64_t seed = 1;
  bool knots_given = false;
};

double processSeconds() {
  std::timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

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

/// The schedule of sec. 5.2, stage by stage on all frames.
struct PaperFit {
  FitState state;
  std::vector<FitTest*> tests;
  std::vector<TestRole> roles;
  int threads = 1;
  int iterations = 0;
};

/// Fits some groups to some tests; the cost that is left, on frames that have an equilibrium.
double fitGroups(PaperFit& fit, const std::vector<int>& chosen, const std::vector<int>& groups) {
  for (const int g : groups) fit.state.updateReference(g);
  FrameEvaluator evaluator(fit.tests, fit.threads, nullptr);
  const auto space = std::make_shared<FitSpace>(fit.state, groups);
  std::vector<FrameId> frames;
  for (const int t : chosen)
    for (int f = 0; f < evaluator.tests()[t]->frameCount(); ++f) frames.push_back({t, f});
  evaluator.configure(space, frames);
  Eigen::VectorXd z = space->start();
  evaluator.dropFailing(z);
  gaussNewton(evaluator, z, fit.iterations);
  fit.state = space->stateAt(z);
  return evaluator.cost();
}

/// One curve: a constant, then one equidistant control point more as long as the residual falls by
/// 1 % ("usually 4 or 5" at most). The range is that of our curve, which is the same histogram's.
/// @param search  false: our knots at once, for a lower bound of what the recipe costs.
void fitCurve(PaperFit& fit, int group, const MaterialComponent& ours, bool search) {
  const std::vector<int> chosen = testsOfGroup(fit.state, group, fit.roles);
  double cost = fitGroups(fit, chosen, {group});
  const std::vector<double> strains = ours.curve.strains();
  if (!search) {
    fit.state.setKnots(group, strains);
    fitGroups(fit, chosen, {group});
    return;
  }
  const double begin = ours.curve.even() ? 0.0 : ours.observed_min;
  for (int knots = 2; knots <= kMaxControlPoints; ++knots) {
    const FitState before = fit.state;
    fit.state.setKnots(group, equidistantKnots(begin, ours.observed_max, knots));
    const double finer = fitGroups(fit, chosen, {group});
    if (finer > cost) fit.state = before;
    if (finer > (1.0 - kImprovement) * cost) return;
    cost = finer;
  }
}

int failed(const Error& error) {
  std::fprintf(stderr, "%s\n", error.message().c_str());
  return 1;
}

/// @param search  for knots; otherwise those of `ours` at once.
Result<int> runPaper(const std::vector<Measurement>& measurements, const FitOptions& options,
                     const Material& ours, bool search, PaperCounts& counts) {
  const ClothModel& model = **findClothModel(options.model);
  std::vector<std::unique_ptr<FitTest>> owned;
  std::vector<const Measurement*> pointers;
  PaperFit fit;
  fit.state = makeFitState(model, {});
  fit.threads = options.threads;
  for (const Measurement& m : measurements) {
    auto judge = makeFitTest(m, model, options.test);
    if (!judge.ok()) return judge.error();
    auto test = makePaperTest(m, model, options.test, std::move(*judge), counts);
    if (!test.ok()) return test.error();
    owned.push_back(std::move(*test));
    fit.tests.push_back(owned.back().get());
    pointers.push_back(&m);
    fit.roles.push_back(testRole(*fit.tests.back(), model));
  }
  setInitialGuesses(fit.state, pointers, fit.roles);
  std::vector<int> again, bent_or_sheared;
  for (const int g : stageOrder(fit.state, fit.roles)) {
    const std::string name = fit.state.groupName(g);
    fitCurve(fit, g, *ours.find(name), search);
    std::printf("  %-14s %d control points %8ld equilibria %10.1f CPU-s\n", name.c_str(),
                static_cast<int>(fit.state.groups[g].basis->knots().size()),
                counts.equilibria.load(), counts.cpu_seconds.load());
    std::fflush(stdout);
    if (fit.state.groups[g].bending || name == "shear") again.push_back(g);
  }
  for (std::size_t t = 0; t < fit.tests.size(); ++t) {
    const auto serves = [&](int g) {
      const std::vector<int> tests = testsOfGroup(fit.state, g, fit.roles);
      return std::ranges::find(tests, static_cast<int>(t)) != tests.end();
    };
    if (std::ranges::any_of(again, serves)) bent_or_sheared.push_back(static_cast<int>(t));
  }
  fitGroups(fit, bent_or_sheared, again);
  return fit.iterations;
}

void print(const char* name, const FitResult& fit, double cpu_seconds) {
  std::printf(
      "%s: %8.1f s, %.1f CPU-s, %d outer iterations, %ld equilibria, %ld Newton steps, %ld "
      "factorizations\n",
      name, fit.seconds, cpu_seconds, fit.outer_iterations,
      fit.material.fit["equilibria"].get<long>(), fit.newton_steps, fit.factorizations);
  std::fflush(stdout);
}

/// Ours, and the processor time it took.
Result<FitResult> runOurs(const std::vector<Measurement>& measurements, const FitOptions& options,
                          double& cpu_seconds) {
  const double begin = processSeconds();
  auto ours = fitMaterial(measurements, options);
  cpu_seconds = processSeconds() - begin;
  return ours;
}

/// The recipe with or without its search for knots, and how much longer it took than ours.
Result<void> comparePaper(const std::vector<Measurement>& measurements, const FitOptions& options,
                          const Material& ours, double our_cpu_seconds, bool search) {
  PaperCounts counts;
  const auto iterations = runPaper(measurements, options, ours, search, counts);
  if (!iterations.ok()) return iterations.error();
  // Sums over threads: the work, whoever else uses the machine.
  std::printf(
      "paper, knots %s: %8.1f CPU-s, %d outer iterations, %ld equilibria (%ld not converged), %ld "
      "damped steps, %ld conjugate-gradient steps\n",
      search ? "searched for" : "given", counts.cpu_seconds.load(), *iterations,
      counts.equilibria.load(), counts.unconverged.load(), counts.steps.load(),
      counts.gradient_steps.load());
  std::printf("ratio of CPU seconds, knots %s both: %.1f\n",
              search ? "searched for by" : "given to", counts.cpu_seconds / our_cpu_seconds);
  std::fflush(stdout);
  return {};
}

int run(const Arguments& arguments) {
  const auto measurements = capture(arguments);
  if (!measurements.ok()) return failed(measurements.error());
  FitOptions options;
  options.model = arguments.model;
  options.threads = arguments.threads;
  options.test.nodes = arguments.nodes;
  options.law_uncertainty = false;
  std::printf("%s, %d frames x 5, %d nodes a side, %d threads\n", arguments.fabric.c_str(),
              arguments.frames, arguments.nodes, arguments.threads);
  double searched_seconds = 0.0, given_seconds = 0.0;
  const auto searched = runOurs(*measurements, options, searched_seconds);
  if (!searched.ok()) return failed(searched.error());
  print("ours, knots searched for", *searched, searched_seconds);
  const Material& material = searched->material;
  FitOptions with_knots = options;
  for (const MaterialComponent& component : material.components)
    with_knots.knots[component.name] = component.curve.strains();
  const auto given = runOurs(*measurements, with_knots, given_seconds);
  if (!given.ok()) return failed(given.error());
  print("ours, knots given       ", *given, given_seconds);

  const auto same_knots = comparePaper(*measurements, options, material, given_seconds, false);
  if (!same_knots.ok()) return failed(same_knots.error());
  if (arguments.knots_given) return 0;
  const auto own_knots = comparePaper(*measurements, options, material, searched_seconds, true);
  return own_knots.ok() ? 0 : failed(own_knots.error());
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
  app.add_flag("--knots-given", arguments.knots_given,
               "leave out the recipe's search for control points, which takes longest");
  CLI11_PARSE(app, argc, argv);
  return tenter::bench::run(arguments);
}
