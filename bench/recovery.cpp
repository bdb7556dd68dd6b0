// SPDX-License-Identifier: GPL-3.0-or-later
// A model in the specimen's place, on the mesh and knots of the fit: does the fit find it again,
// and do its bands cover it? Exit 1 if a figure misses its limit.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "tenter/fitting/fit.h"
#include "tenter/twin/capture.h"

namespace tenter::bench {
namespace {

/// Sum of squares per residual that counts as rounding: residuals a millionth of their noise.
constexpr double kRounding = 1e-12;
constexpr double kRecovered = 0.005;  ///< Of each stiffness that the data see.
constexpr double kCoverageLow = 0.90, kCoverageHigh = 0.99;
constexpr double kBand = 1.96;

struct Arguments {
  std::vector<std::string> models{"stvk", "soft", "springs"};
  int frames = 12, nodes = 25, threads = 2, seeds = 0;
  bool verbose = false;
};

/// Knots of a component and its stiffness at both ends; linear in the coefficients between.
struct TrueCurve {
  const char* component;
  std::vector<double> knots;
  double first, last;
};

std::vector<TrueCurve> trueCurves(const std::string& model) {
  if (model == "springs")
    return {{"stretch_weft", {0.0, 0.15, 0.3}, 40.0, 60.0},
            {"stretch_warp", {0.0, 0.15, 0.3}, 50.0, 65.0},
            {"shear", {0.0, 0.25}, 15.0, 25.0},
            {"bend_weft", {0.0}, 25.0, 25.0},
            {"bend_warp", {0.0}, 35.0, 35.0},
            {"bend_diagonal", {0.0}, 10.0, 10.0}};
  return {{"stretch_weft", {0.0, 0.15, 0.3}, 60.0, 100.0},
          {"stretch_warp", {0.0, 0.15, 0.3}, 80.0, 110.0},
          {"shear", {0.0, 0.25, 0.5}, 15.0, 30.0},
          {"bend_weft", {0.0, 150.0, 300.0}, 2e-6, 3e-6},
          {"bend_warp", {0.0, 150.0, 300.0}, 3e-6, 3.5e-6},
          {"bend_diagonal", {0.0}, 1.2e-6, 1.2e-6}};
}

struct Truth {
  OwnLaw law;
  std::map<std::string, std::vector<double>> knots;
};

Truth truthOf(const std::string& id) {
  const ClothModel& model = **findClothModel(id);
  Truth truth{.law = {id, std::vector<ComponentCurve>(model.componentCount())}, .knots = {}};
  for (const TrueCurve& curve : trueCurves(id)) {
    const int c = model.componentIndex(curve.component);
    const bool even = model.component(c).even;
    const SplineBasis basis = curve.knots.size() < 2 ? SplineBasis::constant(even)
                                                     : SplineBasis::onKnots(curve.knots, even);
    truth.law.components[c].curve =
        basis.curve(Eigen::VectorXd::LinSpaced(basis.size(), curve.first, curve.last));
    truth.knots[curve.component] = curve.knots;
  }
  return truth;
}

Result<std::vector<Measurement>> capture(const Arguments& arguments, const Truth& truth,
                                         std::uint64_t seed, bool noise) {
  std::vector<Measurement> all;
  for (const ProtocolInfo& protocol : protocols()) {
    const bool bias = protocol.id == "bend-bias";
    // Springs run along the sample's edges; they have no bias.
    if (!protocol.for_fitting && !bias) continue;
    if (bias && truth.law.model == "springs") continue;
    CaptureOptions options;
    options.protocol = protocol.id;
    options.seed = seed;
    options.scatter = false;
    options.nodes = arguments.nodes;
    options.frames = arguments.frames;
    options.noise = noise;
    options.cord_friction = false;
    options.own_law = truth.law;
    auto captured = captureMeasurement(options);
    if (!captured.ok()) return captured.error();
    captured->measurement.name = protocol.id;
    all.push_back(std::move(captured->measurement));
  }
  return all;
}

Result<FitResult> fit(const Arguments& arguments, const Truth& truth,
                      const std::vector<Measurement>& measurements) {
  FitOptions options;
  options.model = truth.law.model;
  options.test.nodes = arguments.nodes;
  options.threads = arguments.threads;
  options.knots = truth.knots;
  options.law_uncertainty = false;
  if (arguments.verbose)
    options.progress = [](const FitOptions::Progress& p) {
      std::printf("    %s %d: %.3g\n", p.stage.c_str(), p.iteration, p.cost);
    };
  return fitMaterial(measurements, options);
}

/// One knot of one fit beside the truth.
struct Knot {
  std::string component;
  double strain, fitted, truth, std;
};

std::vector<Knot> observedKnots(const Truth& truth, const Material& material) {
  const ClothModel& model = **findClothModel(truth.law.model);
  std::vector<Knot> knots;
  for (const MaterialComponent& component : material.components) {
    const StiffnessCurve& expected =
        truth.law.components[model.componentIndex(component.name)].curve;
    for (int k = 0; k < component.curve.knotCount(); ++k) {
      if (k >= static_cast<int>(component.knot_observed.size()) || !component.knot_observed[k])
        continue;
      const double strain = component.curve.strains()[k];
      knots.push_back({component.name, strain, component.curve.stiffnesses()[k],
                       expected.evaluate(strain).stiffness, component.knot_std[k]});
    }
  }
  return knots;
}

bool recovers(const Arguments& arguments, const std::string& model) {
  const Truth truth = truthOf(model);
  const auto measurements = capture(arguments, truth, 1, false);
  if (!measurements.ok()) {
    std::printf("%s: capture: %s\n", model.c_str(), measurements.error().message().c_str());
    return false;
  }
  const auto result = fit(arguments, truth, *measurements);
  if (!result.ok()) {
    std::printf("%s: fit: %s\n", model.c_str(), result.error().message().c_str());
    return false;
  }
  double chi2 = 0.0, worst = 0.0;
  for (const TestResidual& test : result->tests) chi2 = std::max(chi2, test.chi2_per_dof);
  const std::vector<Knot> knots = observedKnots(truth, result->material);
  int total = 0;
  for (const auto& [name, strains] : truth.knots) total += static_cast<int>(strains.size());
  for (const Knot& knot : knots) {
    const double error = std::abs(knot.fitted / knot.truth - 1.0);
    worst = std::max(worst, error);
    if (arguments.verbose || error > kRecovered)
      std::printf("  %-14s %8.4g  %.6g, true %.6g\n", knot.component.c_str(), knot.strain,
                  knot.fitted, knot.truth);
  }
  int unseen = 0;
  for (const auto& c : result->material.fit["identifiability"]["combinations"])
    unseen += !c["seen"].get<bool>();
  std::printf(
      "%-8s no noise: chi2/dof at most %.1e, %zu of %d knots observed, worst %.1e, %d combinations "
      "unseen, %.1f s\n",
      model.c_str(), chi2, knots.size(), total, worst, unseen, result->seconds);
  std::fflush(stdout);
  return result->converged && chi2 < kRounding && worst < kRecovered && !knots.empty();
}

bool covers(const Arguments& arguments, const std::string& model) {
  const Truth truth = truthOf(model);
  int inside = 0, pairs = 0, failed = 0;
  std::map<std::string, std::pair<int, int>> by_component;
  for (int seed = 1; seed <= arguments.seeds; ++seed) {
    const auto measurements = capture(arguments, truth, seed, true);
    const auto result =
        measurements.ok() ? fit(arguments, truth, *measurements) : measurements.error();
    if (!result.ok()) {
      ++failed;
      continue;
    }
    const std::vector<Knot> knots = observedKnots(truth, result->material);
    std::printf("  seed %d, %.0f s:", seed, result->seconds);
    for (const Knot& knot : knots) {
      const double error = (knot.fitted - knot.truth) / knot.std;
      const bool covered = std::abs(error) <= kBand;
      if (arguments.verbose || !covered)
        std::printf("\n    %s(%.3g) %+.2f std of %.2g %%", knot.component.c_str(), knot.strain,
                    error, 100.0 * knot.std / knot.truth);
      inside += covered;
      ++pairs;
      by_component[knot.component].first += covered;
      ++by_component[knot.component].second;
    }
    if (arguments.verbose)
      for (const TestResidual& test : result->tests)
        std::printf("\n    %s: chi2/dof %.2f, discrepancy %.2g mm", test.measurement.c_str(),
                    test.chi2_per_dof, 1e3 * test.discrepancy_m);
    std::printf("\n  %d of %d pairs inside so far\n", inside, pairs);
    std::fflush(stdout);
  }
  const double coverage = pairs > 0 ? static_cast<double>(inside) / pairs : 0.0;
  std::printf(
      "%-8s noise, %d seeds: bands cover %.1f %% of %d pairs (knot, seed), %d fits failed\n",
      model.c_str(), arguments.seeds, 100.0 * coverage, pairs, failed);
  for (const auto& [name, count] : by_component)
    std::printf("  %-14s %d of %d\n", name.c_str(), count.first, count.second);
  std::fflush(stdout);
  return failed == 0 && coverage >= kCoverageLow && coverage <= kCoverageHigh;
}

}  // namespace
}  // namespace tenter::bench

int main(int argc, char** argv) {
  tenter::bench::Arguments arguments;
  CLI::App app(
      "Fits to data that the fitted model made itself: recovery without noise, coverage of the "
      "bands with it");
  app.add_option("--models", arguments.models)->capture_default_str();
  app.add_option("--frames", arguments.frames, "of each measurement")->capture_default_str();
  app.add_option("--nodes", arguments.nodes, "a side of specimen and replica")
      ->capture_default_str();
  app.add_option("--threads", arguments.threads)->capture_default_str();
  app.add_option("--seeds", arguments.seeds, "noisy repeats; 0 leaves coverage out")
      ->capture_default_str();
  app.add_flag("--verbose", arguments.verbose);
  CLI11_PARSE(app, argc, argv);
  bool good = true;
  for (const std::string& model : arguments.models) {
    good = tenter::bench::recovers(arguments, model) && good;
    if (arguments.seeds > 0) good = tenter::bench::covers(arguments, model) && good;
  }
  return good ? 0 : 1;
}
