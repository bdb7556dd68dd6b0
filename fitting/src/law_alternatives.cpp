// SPDX-License-Identifier: GPL-3.0-or-later
#include "law_alternatives.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "fit_output.h"

namespace tenter {
namespace {

/// c_p = ratio * sqrt(k_weft k_warp): the ratio of ordinary woven cloth, and of most isotropic
/// sheets.
constexpr double kPoissonRatio = 0.3;
/// An alternative counts when its sum of squares is at most this times that of the diagonal law (or
/// of pure noise).
constexpr double kAboutAsGood = 1.5;
/// A few iterations on a few frames tell whether a law meets the data about as well.
constexpr FitRun::Refit kRefit{
    .frames = 6, .rounds = 2, .max_iterations = 6, .relative_tolerance = 1e-2};

/// Couplings of an alternative. They are given, not fitted: three angles hardly tell a coupling
/// from a curve of the shear, so a fit would leave it near where it began, and what matters is what
/// such a law would say elsewhere.
struct Alternative {
  const char* name;
  double poisson_ratio;
  double stiffening;  ///< By the largest measured stretch, in shear stiffnesses at rest.
};
constexpr Alternative kAlternatives[] = {
    {"poisson", kPoissonRatio, 0.0},
    {"cross-stiffening", 0.0, 1.0},
    {"strong cross-stiffening", 0.0, 4.0},
    {"cross-softening", 0.0, -0.8},
};
/// Where no stretch was measured.
constexpr double kOrdinaryStretch = 0.05;

/// The model with the same strains and all of this one's components, and couplings besides.
const ClothModel* coupledSister(const ClothModel& model) {
  for (const ClothModel& other : clothModels()) {
    const bool same = other.membrane == model.membrane && other.bending == model.bending &&
                      other.componentCount() > model.componentCount();
    if (!same || other.componentIndex("poisson") < 0 ||
        other.componentIndex("cross_stiffening") < 0)
      continue;
    bool all = true;
    for (int c = 0; c < model.componentCount(); ++c)
      all = all && other.componentIndex(model.component(c).name) >= 0;
    if (all) return &other;
  }
  return nullptr;
}

/// The fitted curves in the sister's terms, couplings at rest.
FitState translate(const FitState& fitted, const ClothModel& sister) {
  FitState state{.model = &sister, .groups = fitted.groups};
  for (ParameterGroup& group : state.groups)
    for (int& c : group.members) c = sister.componentIndex(fitted.model->component(c).name);
  for (ParameterGroup& group : makeFitState(sister, {}).groups)
    if (state.groupOf(group.members.front()) < 0) state.groups.push_back(std::move(group));
  return state;
}

double stiffnessAtRest(const FitState& state, const char* name) {
  return state.componentCurve(state.model->componentIndex(name)).curve.evaluate(0.0).stiffness;
}

double largestStretch(const FitState& state) {
  double largest = 0.0;
  for (const char* name : {"stretch_weft", "stretch_warp"}) {
    const int component = state.model->componentIndex(name);
    largest = std::max(largest, state.componentCurve(component).curve.strains().back());
  }
  return largest > 0.0 ? largest : kOrdinaryStretch;
}

void setCouplings(FitState& state, const Alternative& alternative) {
  const double stretch =
      std::sqrt(stiffnessAtRest(state, "stretch_weft") * stiffnessAtRest(state, "stretch_warp"));
  const int poisson = state.groupOf(state.model->componentIndex("poisson"));
  const int cross = state.groupOf(state.model->componentIndex("cross_stiffening"));
  state.setConstant(poisson, alternative.poisson_ratio * stretch);
  const double scale =
      std::max(stiffnessAtRest(state, "shear"), 1e-3 * stretch) / largestStretch(state);
  state.setConstant(cross, alternative.stiffening * scale);
}

std::vector<int> movingGroups(const FitState& state, const FitRun& run) {
  std::vector<int> groups;
  for (const int g : seenGroups(state, run.roles()))
    if (!state.groups[g].bending && !state.groups[g].may_be_negative) groups.push_back(g);
  return groups;
}

std::vector<Measurement> membraneMeasurements(const FitRun& fitted,
                                              const std::vector<Measurement>& measurements) {
  const int membrane = static_cast<int>(fitted.state().model->membrane_components.size());
  std::vector<Measurement> chosen;
  for (std::size_t t = 0; t < measurements.size(); ++t)
    if (std::ranges::any_of(fitted.roles()[t].observed, [&](int c) { return c < membrane; }))
      chosen.push_back(measurements[t]);
  return chosen;
}

/// Sum of squares of the diagonal law on the frames that the alternatives are judged on; not finite
/// if one has no equilibrium.
double diagonalChi2(FitRun& run, const FitState& start) {
  const bool solved = run.refit(start, movingGroups(start, run), {.frames = kRefit.frames});
  return solved ? 2.0 * run.last().cost : std::numeric_limits<double>::infinity();
}

nlohmann::json alternativeJson(FitRun& run, const Alternative& alternative, double chi2,
                               const std::vector<Measurement>& measurements,
                               const FitOptions& options) {
  const FitSpace& space = run.evaluator().space();
  Material material =
      materialOf(run, run.state(), space, nullptr, run.last().z, measurements, options);
  material.fit = nullptr;
  return {{"name", alternative.name}, {"chi2", chi2}, {"material", materialToJson(material)}};
}

}  // namespace

nlohmann::json lawAlternatives(const FitRun& fitted, const std::vector<Measurement>& measurements,
                               const FitOptions& options, const TestFactory& factory,
                               SolveCounts& counts) {
  const ClothModel* sister = coupledSister(*fitted.state().model);
  const std::vector<Measurement> chosen = membraneMeasurements(fitted, measurements);
  if (!sister || chosen.empty()) return nullptr;
  auto tests = makeTests(chosen, *sister, options.test, factory);
  if (!tests.ok()) return nullptr;
  std::vector<FitTest*> pointers;
  for (const auto& test : *tests) pointers.push_back(test.get());

  FitRun run(*sister, pointers, options);
  const FitState start = translate(fitted.state(), *sister);
  const double diagonal = diagonalChi2(run, start);
  if (!std::isfinite(diagonal)) return nullptr;
  double residuals = 0.0;
  for (std::size_t t = 0; t < chosen.size(); ++t)
    residuals += run.evaluator().rawResidualCount(static_cast<int>(t));
  nlohmann::json json = {{"coupled_law", sister->id},
                         {"diagonal_chi2", diagonal},
                         {"residuals", residuals},
                         {"alternatives", nlohmann::json::array()},
                         {"rejected", nlohmann::json::array()}};
  for (const Alternative& alternative : kAlternatives) {
    if (run.evaluator().cancelled()) break;
    FitState coupled = start;
    setCouplings(coupled, alternative);
    if (!run.refit(coupled, movingGroups(coupled, run), kRefit)) {
      json["rejected"].push_back({{"name", alternative.name}, {"chi2", nullptr}});
      continue;
    }
    const double chi2 = 2.0 * run.last().cost;
    if (chi2 <= kAboutAsGood * std::max(diagonal, residuals))
      json["alternatives"].push_back(alternativeJson(run, alternative, chi2, chosen, options));
    else
      json["rejected"].push_back({{"name", alternative.name}, {"chi2", chi2}});
  }
  const SolveCounts& more = run.evaluator().counts();
  counts.newton_steps += more.newton_steps;
  counts.factorizations += more.factorizations;
  counts.evaluations += more.evaluations;
  return json;
}

}  // namespace tenter
