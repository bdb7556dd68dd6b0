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
constexpr int kIterations = 8;
constexpr double kTolerance = 1e-3;

/// Couplings of an alternative. They are given, not fitted: three angles hardly tell a coupling
/// from a curve of the shear, so a fit would leave it near where it began, and what matters is what
/// such a law would say elsewhere.
struct Alternative {
  const char* name;
  double poisson_ratio;
  double stiffening;  ///< Shear stiffness at rest is doubled by a stretch of kStrain over this.
};
constexpr double kStrain = 0.05;
constexpr Alternative kAlternatives[] = {
    {"poisson", kPoissonRatio, 0.0},
    {"cross-stiffening", 0.0, 1.0},
    {"strong cross-stiffening", 0.0, 4.0},
    {"cross-softening", 0.0, -1.0},
};

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

void setCouplings(FitState& state, const Alternative& alternative) {
  const double stretch =
      std::sqrt(stiffnessAtRest(state, "stretch_weft") * stiffnessAtRest(state, "stretch_warp"));
  const int poisson = state.groupOf(state.model->componentIndex("poisson"));
  const int cross = state.groupOf(state.model->componentIndex("cross_stiffening"));
  state.setConstant(poisson, alternative.poisson_ratio * stretch);
  const double scale = std::max(stiffnessAtRest(state, "shear"), 1e-3 * stretch) / kStrain;
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

/// Sum of squares of the diagonal law on the frames that the alternatives are judged on.
double diagonalChi2(FitRun& run, const FitState& start) {
  const auto space = std::make_shared<FitSpace>(start, seenGroups(start, run.roles()));
  run.evaluator().configure(space, run.evaluator().frames());
  if (!run.evaluator().evaluate(space->start())) return std::numeric_limits<double>::infinity();
  return 2.0 * run.evaluator().cost();
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
  double diagonal = -1.0;
  nlohmann::json json = {{"coupled_law", sister->id},
                         {"alternatives", nlohmann::json::array()},
                         {"rejected", nlohmann::json::array()}};
  for (const Alternative& alternative : kAlternatives) {
    FitState coupled = start;
    setCouplings(coupled, alternative);
    const bool usable = !run.evaluator().cancelled() &&
                        run.refit(coupled, movingGroups(coupled, run), kIterations, kTolerance);
    if (!usable) continue;
    const double chi2 = 2.0 * run.last().cost;
    const nlohmann::json entry = alternativeJson(run, alternative, chi2, chosen, options);
    if (diagonal < 0.0) diagonal = diagonalChi2(run, start);
    double residuals = 0.0;
    for (std::size_t t = 0; t < chosen.size(); ++t)
      residuals += run.evaluator().rawResidualCount(static_cast<int>(t));
    json["diagonal_chi2"] = diagonal;
    json["residuals"] = residuals;
    const bool as_good = chi2 <= kAboutAsGood * std::max(diagonal, residuals);
    if (as_good)
      json["alternatives"].push_back(entry);
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
