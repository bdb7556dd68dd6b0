// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "initial_guess.h"

namespace tenter {
namespace {

constexpr double kOutlierQuantile = 0.005;
/// Frames a test in the stages before the last: enough for five knots, and three times fewer
/// equilibria.
constexpr int kEarlyFrames = 12;
/// At least this many residuals a test in those stages, or noise passes for knots: strips have one
/// a frame.
constexpr int kEarlyResiduals = 40;
constexpr int kScanFrames = 4;
/// Stages stop when the cost falls by less than 1 % ([Est12] sec. 5.1); the last pass goes on to
/// where equilibria are noise.
constexpr double kEarlyTolerance = 1e-2;
constexpr double kFinalTolerance = 1e-6;
constexpr int kEarlyIterations = 10;
/// Rounds over the blocks end when none lowers its cost by more than this share, or than this many
/// misfits per residual: a gain of x of those moves the curves by sqrt(2 x) standard deviations.
/// Where the model cannot meet the data and not noise is what is left, the share grows with the
/// misfit, up to the 1 % of [Est12] sec. 5.1.
constexpr double kSettledGain = 1e-4, kSettledMisfits = 0.05, kMostSettledGain = 1e-2;
constexpr int kMaxPasses = 6;
constexpr double kRefitGain = 0.2;
/// Ranges narrower than this share of their place hold one knot only.
constexpr double kNarrowRange = 1e-6;
/// Sum of squares per residual below which data are met to rounding and knots cannot help.
constexpr double kNothingLeft = 1e-12;
/// A curve gets at most a coefficient for this many residuals: one hanging strip knows one number.
constexpr int kResidualsPerCoefficient = 2;
/// The golden ratio's fraction: its multiples spread over [0, 1) without rhythm.
constexpr double kGolden = 0.6180339887498949;

double quantile(const std::vector<std::pair<double, double>>& sorted, double total, double share) {
  double sum = 0.0;
  for (const auto& [strain, weight] : sorted) {
    sum += weight;
    if (sum >= share * total) return strain;
  }
  return sorted.back().first;
}

}  // namespace

std::vector<double> equidistantKnots(double begin, double end, int count) {
  if (count < 2) return {0.0};
  std::vector<double> knots(count);
  for (int i = 0; i < count; ++i)
    knots[i] = i + 1 == count ? end : begin + (end - begin) * i / (count - 1);
  return knots;
}

std::vector<int> spreadFrames(int frame_count, int wanted) {
  std::vector<bool> chosen(frame_count, wanted <= 0 || wanted >= frame_count);
  if (wanted > 0 && wanted < frame_count) {
    int count = 0;
    for (int i = 1; count < wanted; ++i) {
      const int frame = static_cast<int>(std::fmod(kGolden * i, 1.0) * frame_count);
      if (!chosen[frame]) ++count;
      chosen[frame] = true;
    }
  }
  std::vector<int> frames;
  for (int i = 0; i < frame_count; ++i)
    if (chosen[i]) frames.push_back(i);
  return frames;
}

StrainRange strainRange(const std::vector<FitTest::StrainSamples>& samples, bool even) {
  std::vector<std::pair<double, double>> sorted;
  double total = 0.0;
  for (const FitTest::StrainSamples& s : samples)
    for (std::size_t i = 0; i < s.strain.size(); ++i) {
      if (!std::isfinite(s.strain[i]) || !(s.weight[i] > 0.0)) continue;
      sorted.emplace_back(even ? std::abs(s.strain[i]) : s.strain[i], s.weight[i]);
      total += s.weight[i];
    }
  if (sorted.empty()) return {};
  std::ranges::sort(sorted);
  return {even ? 0.0 : quantile(sorted, total, kOutlierQuantile),
          quantile(sorted, total, 1.0 - kOutlierQuantile)};
}

FitRun::FitRun(const ClothModel& model, std::vector<FitTest*> tests, const FitOptions& options)
    : options_(options),
      tests_(tests),
      state_(makeFitState(model, options.variant)),
      evaluator_(std::move(tests), options.threads, options.cancelled) {
  for (const FitTest* test : tests_) roles_.push_back(testRole(*test, model));
  tieUnseenDirections(state_, roles_);
}

std::vector<int> FitRun::allTests() const {
  std::vector<int> all(tests_.size());
  for (std::size_t t = 0; t < tests_.size(); ++t) all[t] = static_cast<int>(t);
  return all;
}

std::vector<FrameId> FitRun::framesOf(const std::vector<int>& tests, int per_test,
                                      int least_residuals) const {
  std::vector<FrameId> frames;
  for (const int t : tests) {
    int wanted = per_test;
    if (per_test > 0 && tests_[t]->frameCount() > 0)
      wanted = std::max(per_test, least_residuals / std::max(1, tests_[t]->residualCount(0)));
    for (const int f : spreadFrames(tests_[t]->frameCount(), wanted))
      if (tests_[t]->residualCount(f) > 0) frames.push_back({t, f});
  }
  return frames;
}

void FitRun::reweigh(const std::vector<int>& tests) {
  for (const int t : tests) {
    tests_[t]->updateDiscrepancy();
    tests_[t]->reweigh();
  }
}

void FitRun::noteDropped(int dropped, const std::string& stage) {
  if (dropped > 0)
    warnings.push_back(std::to_string(dropped) +
                       " frames have no stable equilibrium at the start of " + stage +
                       " and were left out there");
}

bool FitRun::solve(const std::vector<int>& groups, const std::vector<int>& tests, int per_test,
                   const OuterOptions& outer, const std::string& stage) {
  for (const int g : groups) state_.updateReference(g);
  const auto space = std::make_shared<FitSpace>(state_, groups);
  evaluator_.configure(space, framesOf(tests, per_test, kEarlyResiduals));
  const Eigen::VectorXd start = space->start();
  noteDropped(evaluator_.dropFailing(start), stage);
  if (evaluator_.frames().empty() || space->size() == 0 || !evaluator_.evaluate(start))
    return false;
  long residuals = 0;
  for (const int t : tests) residuals += evaluator_.rawResidualCount(t);
  OuterOptions chosen = outer;
  chosen.misfit = 2.0 * evaluator_.cost() / static_cast<double>(residuals);
  chosen.progress = [&](int iteration, double cost) {
    if (!options_.progress) return;
    options_.progress(
        {stage, iteration, cost, std::sqrt(2.0 * cost / static_cast<double>(residuals))});
  };
  last_ = solveOuter(evaluator_, start, chosen);
  outer_iterations += last_.iterations;
  if (!last_.usable) return false;
  if (last_.blocked)
    warnings.push_back(stage +
                       ": even the shortest step led to a frame without a stable equilibrium; the "
                       "best point so far was kept");
  state_ = space->stateAt(last_.z);
  return true;
}

/// How badly the tests are met at the point evaluated last. Until it is known by how much a law
/// misses them, a test of thousands of tracked vertices would outvote any number of forces: where
/// both choose a stiffness, a factor in one test's misfit weighs as much as in another's.
double FitRun::scanScore(const std::vector<int>& tests, bool mixed) const {
  if (!mixed) return evaluator_.cost();
  double sum = 0.0;
  for (const int t : tests)
    sum +=
        std::log(kNothingLeft + evaluator_.cost(t) / std::max(1, evaluator_.rawResidualCount(t)));
  return sum;
}

/// Tries decades around the guess on a few frames, each from the measured shape (nothing is
/// accepted in between).
void FitRun::scan(int group, const std::vector<int>& tests) {
  const double guess = state_.groups[group].coefficients.mean();
  const bool mixed =
      state_.groups[group].bending && state_.model->bending == BendingElement::kSprings;
  const int decades = mixed ? 3 : state_.groups[group].bending ? 2 : 1;
  const int per_test = std::max(mixed ? 2 : 1, kScanFrames / static_cast<int>(tests.size()));
  double best = guess, best_score = std::numeric_limits<double>::infinity();
  std::vector<double> factors{1.0};
  for (int d = 1; d <= decades; ++d) {
    factors.push_back(std::pow(10.0, d));
    factors.push_back(std::pow(10.0, -d));
  }
  for (const double factor : factors) {
    if (evaluator_.cancelled()) return;
    state_.setConstant(group, factor * guess);
    const auto space = std::make_shared<FitSpace>(state_, std::vector<int>{group});
    evaluator_.configure(space, framesOf(tests, per_test));
    if (!evaluator_.evaluate(space->start())) continue;
    const double score = scanScore(tests, mixed);
    if (score >= best_score) continue;
    best_score = score;
    best = factor * guess;
  }
  state_.setConstant(group, best);
  if (mixed) {
    const auto space = std::make_shared<FitSpace>(state_, std::vector<int>{group});
    evaluator_.configure(space, framesOf(tests, kEarlyFrames));
    (void)evaluator_.evaluate(space->start(), false);
    evaluator_.accept();
  }
  reweigh(tests);
}

const std::vector<double>* FitRun::givenKnots(int group) const {
  for (const int c : state_.groups[group].members) {
    const auto given = options_.knots.find(std::string(state_.model->component(c).name));
    if (given != options_.knots.end()) return &given->second;
  }
  return nullptr;
}

StrainRange FitRun::rangeOf(int component, const std::vector<int>& tests) const {
  std::vector<FitTest::StrainSamples> samples;
  for (const int t : tests)
    if (std::ranges::find(roles_[t].observed, component) != roles_[t].observed.end())
      samples.push_back(tests_[t]->strainSamples(component));
  return strainRange(samples, state_.model->component(component).even);
}

void FitRun::addKnots(int group, const std::vector<int>& tests, const OuterOptions& outer) {
  const std::string name = state_.groupName(group);
  if (const std::vector<double>* given = givenKnots(group)) {
    state_.setKnots(group, *given);
    solve({group}, tests, kEarlyFrames, outer, name);
    return;
  }
  StrainRange range{std::numeric_limits<double>::infinity(),
                    -std::numeric_limits<double>::infinity()};
  for (int i = 0; i < state_.groups[group].assumed_from; ++i) {
    const StrainRange r =
        rangeOf(state_.groups[group].members[i], isolatingTests(state_, group, roles_));
    range = {std::min(range.begin, r.begin), std::max(range.end, r.end)};
  }
  const double width = range.end - range.begin;
  if (!(width > kNarrowRange * std::max(std::abs(range.begin), std::abs(range.end)))) return;
  double cost = last_.cost;
  long residuals = 0;
  for (const int t : tests) residuals += evaluator_.rawResidualCount(t);
  // Every coefficient takes up a residual's worth of noise; that is no improvement.
  const auto perFreedom = [&](double value) {
    const long left = residuals - state_.groups[group].basis->size();
    return value / static_cast<double>(std::max(1L, left));
  };
  for (int knots = 2; knots <= options_.max_knots && !evaluator_.cancelled(); ++knots) {
    if (2.0 * cost < kNothingLeft * static_cast<double>(evaluator_.frames().size())) return;
    const FitState before = state_;
    const double wanted = (1.0 - options_.knot_improvement) * perFreedom(cost);
    state_.setKnots(group, equidistantKnots(range.begin, range.end, knots));
    const bool affordable =
        kResidualsPerCoefficient * state_.groups[group].basis->size() <= residuals;
    const bool better = affordable && solve({group}, tests, kEarlyFrames, outer, name) &&
                        perFreedom(last_.cost) <= wanted;
    if (!better) {
      state_ = before;
      return;
    }
    cost = last_.cost;
  }
}

void FitRun::fitGroup(int group) {
  const std::vector<int> tests = testsOfGroup(state_, group, roles_);
  const std::string name = state_.groupName(group);
  const OuterOptions outer{
      .relative_tolerance = kEarlyTolerance, .max_iterations = kEarlyIterations, .progress = {}};
  scan(group, tests);
  if (!solve({group}, tests, kEarlyFrames, outer, name)) return;
  reweigh(tests);
  if (!solve({group}, tests, kEarlyFrames, outer, name)) return;
  state_.setConstant(group, state_.groups[group].coefficients[0]);
  if (!options_.variant.linear && !state_.groups[group].constant_only)
    addKnots(group, tests, outer);
}

/// One block on its own tests; true if there is a point to go on from.
/// @param radius  of the block's trust region: where its shapes held only for short steps, the next
/// stage does not begin with long ones again.
bool FitRun::refineBlock(const FitBlock& block, int pass, double& radius) {
  const OuterOptions early{
      .relative_tolerance = kEarlyTolerance, .max_iterations = kEarlyIterations, .progress = {}};
  OuterOptions tight{.relative_tolerance = kFinalTolerance,
                     .max_iterations = options_.max_outer_iterations,
                     .progress = {}};
  if (pass == 0) {
    reweigh(block.tests);
    if (!solve(block.groups, block.tests, kEarlyFrames, early, "refinement")) return false;
    radius = std::min(radius, last_.radius);
    if (evaluator_.cancelled()) return true;
    reweigh(block.tests);
  }
  if (pass == 1) {
    // What the early frames and the first curves missed was not all the law's.
    for (const int t : block.tests) tests_[t]->updateDiscrepancy();
    reconsiderShapes(block);
  }
  tight.first_radius = radius;
  if (!solve(block.groups, block.tests, 0, tight, "all frames")) return false;
  radius = std::min(OuterOptions{}.first_radius, last_.radius);
  return true;
}

/// The way from the first guess may have led a frame into another stable shape than the cloth's.
void FitRun::reconsiderShapes(const FitBlock& block) {
  const auto space = std::make_shared<FitSpace>(state_, block.groups);
  evaluator_.configure(space, framesOf(block.tests, 0));
  if (!evaluator_.evaluate(space->start(), false)) return;
  evaluator_.accept();
  evaluator_.adoptNearerShapes();
}

double FitRun::negligibleGain() const {
  long residuals = 0;
  for (const FrameId& id : evaluator_.frames())
    residuals += tests_[id.test]->residualCount(id.frame);
  const double misfit = 2.0 * last_.cost / static_cast<double>(std::max(1L, residuals));
  const double share = std::min(kSettledGain * std::max(1.0, misfit), kMostSettledGain);
  return std::max(share * last_.initial_cost, kSettledMisfits * misfit);
}

/// Block after block, until a round changes nothing any more: what one block gives, the next takes
/// as given.
bool FitRun::refine() {
  refined_ = seenGroups(state_, roles_);
  blocks_ = fitBlocks(state_, roles_);
  if (blocks_.empty()) return false;
  std::vector<double> radii(blocks_.size(), OuterOptions{}.first_radius);
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    bool settled = true, all_converged = true;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      if (evaluator_.cancelled()) return true;
      if (!refineBlock(blocks_[b], pass, radii[b])) return false;
      all_converged = all_converged && last_.converged;
      settled = settled && last_.initial_cost - last_.cost <= negligibleGain();
    }
    converged = all_converged && !evaluator_.cancelled();
    complete_ = true;
    if (settled) return true;
  }
  return true;
}

bool FitRun::run() {
  evaluator_.requireProof(false);
  std::vector<const Measurement*> measurements;
  for (const FitTest* test : tests_) measurements.push_back(&test->measurement());
  setInitialGuesses(state_, measurements, roles_);
  for (const int group : stageOrder(state_, roles_)) {
    if (evaluator_.cancelled()) break;
    if (!state_.groups[group].may_be_negative) fitGroup(group);
  }
  const bool refined = refine();
  return refined || evaluator_.cancelled();
}

bool FitRun::settle() {
  if (!last_.usable) return false;
  if (!complete_) {
    refined_ = seenGroups(state_, roles_);
    blocks_ = fitBlocks(state_, roles_);
  }
  const auto space = std::make_shared<FitSpace>(state_, refined_);
  evaluator_.requireProof(true);
  evaluator_.configure(space, framesOf(allTests(), complete_ ? 0 : kEarlyFrames, kEarlyResiduals));
  last_.z = space->start();
  noteDropped(evaluator_.dropFailing(last_.z), "the statistics");
  if (evaluator_.frames().empty() || !evaluator_.evaluate(last_.z, false)) return false;
  evaluator_.accept();
  return true;
}

bool FitRun::refit(FitState start, const std::vector<int>& groups, const Refit& how) {
  evaluator_.requireProof(false);
  state_ = std::move(start);
  refined_ = groups;
  complete_ = false;
  const auto space = std::make_shared<FitSpace>(state_, refined_);
  evaluator_.configure(space, framesOf(allTests(), how.frames, kEarlyResiduals));
  // The first to fail says that this cloth is another; the rest would take minutes to say the same.
  if (!evaluator_.evaluate(space->start())) return false;
  evaluator_.accept();
  last_ = {.z = space->start(),
           .initial_cost = evaluator_.cost(),
           .cost = evaluator_.cost(),
           .usable = true};
  const OuterOptions outer{.max_rejected_steps = 1,
                           .relative_tolerance = how.relative_tolerance,
                           .max_iterations = how.max_iterations,
                           .progress = {}};
  // Another law starts from a misfit that is not noise: the second round knows better what noise
  // is.
  for (int round = 0; round < how.rounds; ++round) {
    if (!solve(refined_, allTests(), how.frames, outer, "alternative law")) return false;
    if (last_.cost > (1.0 - kRefitGain) * last_.initial_cost) break;
  }
  converged = last_.converged;
  return true;
}

}  // namespace tenter
