// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/equilibrium.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

#include "smallest_eigenvalue.h"
#include "tenter/mechanics/sparse_cholesky.h"
#include "tenter/mechanics/turning_path.h"

namespace tenter {
namespace {

constexpr double kForceToleranceOfNodeWeight = 1e-4;
/// Forces are resolved to this many roundings of the positions, times the stiffest degree of
/// freedom.
constexpr double kRoundings = 8.0;
/// An indefinite Hessian is mixed with its element-wise projection. The share of the projection:
/// first try, growth where that was not enough, ease after a step that went as foreseen, growth
/// after one that did not, and below which the exact Hessian is tried again.
constexpr double kFirstShare = 0.4, kShareGrowth = 10.0, kEase = 0.2, kStiffen = 2.0;
constexpr double kLeastShare = 0.02;
/// The projection is the Hessian itself, to this share of its stiffest entry.
constexpr double kSameMatrix = 1e-12;
/// Smallest shift of a singular or indefinite matrix, as a share of its stiffest entry.
constexpr double kLeastShift = 1e-9, kShiftGrowth = 4.0;
/// The energy's change over the one foreseen: below the first a step was in vain, below the second
/// half of it may be better, above the third it went as foreseen, above the last twice of it may be
/// better.
constexpr double kInVain = 0.1, kTooLong = 0.25, kAsForeseen = 0.5, kTooShort = 1.2;
constexpr double kLongestReach = 0.04;  ///< Of steps that are made longer, in the sheet's size.
constexpr double kArmijo = 1e-4;
constexpr int kMaxBacktracks = 40;
/// After so many shortened steps in a row, or so many steps at all, they are straight, and full
/// ones may raise the energy so often before they pay.
constexpr int kCreeping = 8, kPatience = 60, kWatchdog = 4;
constexpr int kMaxSaddles = 20;
constexpr int kInverseIterations = 6;
constexpr double kGoldenAngle = 2.399963;  ///< Starts inverse iteration without a symmetry.
/// Moves off a saddle, as shares of the sheet's size.
constexpr double kFirstEscape = 1e-5, kLastEscape = 0.2;
/// A full step that cuts the residual to this share shows that its factors serve for further steps,
/// and each of those that cuts it to the second that they go on serving.
constexpr double kFactorsNear = 0.05, kFactorsServe = 0.3;

using Clock = std::chrono::steady_clock;

double stiffestEntry(const SparseLower& h) {
  double stiffest = 0.0;
  for (int c = 0; c < h.size; ++c) stiffest = std::max(stiffest, h.value[h.column_begin[c]]);
  return stiffest;
}

std::vector<int> heldNodes(const SystemSetup& setup) {
  std::vector<int> held = setup.fixed_nodes;
  for (const ClipSetup& clip : setup.clips)
    held.insert(held.end(), clip.nodes.begin(), clip.nodes.end());
  return held;
}

double sizeOf(const ClothState& state) { return std::max(state.q.cwiseAbs().maxCoeff(), 1e-3); }

}  // namespace

struct EquilibriumSolver::Impl {
  explicit Impl(const ClothSystem& s)
      : system(s),
        mixed(s.hessian(s.restState(), Projection::kNone)),
        cholesky(mixed),
        mass(s.dofMass()),
        path(s.sheet().rest, heldNodes(s.setup())) {
    g.resize(s.dofCount());
    trial_g.resize(s.dofCount());
    step.resize(s.dofCount());
  }

  const ClothSystem& system;
  SparseLower mixed;  ///< The exact Hessian and `share` of its projection.
  std::vector<double> exact;
  SparseCholesky cholesky;
  Eigen::VectorXd mass;
  TurningPath path;
  SparseLower held;  ///< Hessian of a sheet that swivels, with one degree of freedom held.
  bool hold_swivel = false;
  double last_shift = 0.0;    ///< That served, as a share of the stiffest entry.
  double share = 0.0;         ///< Of the projection, to begin with.
  double used_share = 0.0;    ///< Of the projection in the factors at hand.
  bool factors_near = false;  ///< Those are of an exact Hessian close by.
  Eigen::VectorXd g, trial_g, step;
  int short_steps = 0;    ///< In a row.
  bool straight = false;  ///< Turning triangles did not serve.
  /// Last state from which the energy has to fall, and the Newton step there (watchdog).
  struct Reference {
    ClothState state;
    double energy = 0.0;
    Eigen::VectorXd g, step;
    int steps_since = 0;
  } reference;
  ClothState trial, other;

  const SparseLower& hessian(const ClothState& state, Projection projection);
  double roundingOfForces(const ClothState& state);
  bool tryFullStep(ClothState& state, double& energy);
  double residual(const Eigen::VectorXd& gradient) const { return gradient.cwiseAbs().maxCoeff(); }
  bool newtonDirection(const ClothState& state, EquilibriumSummary& summary, bool from_exact);
  bool factorizeMixed(const ClothState& state, EquilibriumSummary& summary);
  bool factorizeShifted(const ClothState& state, EquilibriumSummary& summary);
  double fullStep(const ClothState& state) const;
  double energyAt(const ClothState& state, double alpha, ClothState& place) const;
  void rescale(const ClothState& state, double factor, double& alpha, double& e);
  bool lineSearch(ClothState& state, double& energy);
  bool stepWithOldFactors(ClothState& state, double& energy);
  const Eigen::VectorXd& softestDirection();
  bool leaveSaddle(ClothState& state, double& energy, EquilibriumSummary& summary);
  void measureStability(const ClothState& state, EquilibriumSummary& summary);
  Termination iterate(ClothState& state, const EquilibriumOptions& options,
                      EquilibriumSummary& summary, Clock::time_point start);
};

/// With the swivel held the matrix is definite exactly where the Hessian is but for the swivel, and
/// Newton's steps differ by a swivel only, because no gradient has a part along it.
const SparseLower& EquilibriumSolver::Impl::hessian(const ClothState& state,
                                                    Projection projection) {
  const SparseLower& h = system.hessian(state, projection);
  const int dof = hold_swivel ? system.swivelDof(state) : -1;
  if (dof < 0) return h;
  held = h;
  held.value[held.column_begin[dof]] += stiffestEntry(h);
  return held;
}

/// step = -M^-1 g. M is the exact Hessian H if that is positive definite, otherwise H + s (P - H)
/// with P its element-wise projection and s as small as serves, searched for from where the last
/// one was; `from_exact` searches from H. What makes a buckling sheet indefinite is compression,
/// which a few elements may carry a thousand times more of than the rest: this takes from each in
/// proportion, where a multiple of the identity would hold back the whole sheet for the worst of
/// them. Returns whether H itself served.
bool EquilibriumSolver::Impl::newtonDirection(const ClothState& state, EquilibriumSummary& summary,
                                              bool from_exact) {
  used_share = 0.0;
  factors_near = false;
  bool served = false;
  if (share < kLeastShare || from_exact) {
    ++summary.factorizations;
    served = cholesky.factorize(hessian(state, Projection::kNone));
    share = served ? 0.0 : std::max(share, kFirstShare);
  }
  if (!served && !factorizeMixed(state, summary)) {
    step = -g / std::max(stiffestEntry(mixed), std::numeric_limits<double>::min());
    return false;
  }
  cholesky.solve(g, step);
  step = -step;
  return served;
}

bool EquilibriumSolver::Impl::factorizeMixed(const ClothState& state, EquilibriumSummary& summary) {
  exact = hessian(state, Projection::kNone).value;
  const SparseLower& projected = hessian(state, Projection::kPositiveSemiDefinite);
  double apart = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i)
    apart = std::max(apart, std::abs(projected.value[i] - exact[i]));
  if (apart <= kSameMatrix * stiffestEntry(projected)) share = 1.0;  // nothing is compressed
  for (;; share = std::min(1.0, kShareGrowth * share)) {
    for (std::size_t i = 0; i < exact.size(); ++i)
      mixed.value[i] = exact[i] + share * (projected.value[i] - exact[i]);
    ++summary.factorizations;
    used_share = share;
    if (cholesky.factorize(mixed, share < 1.0 ? 0.0 : kLeastShift * stiffestEntry(mixed)))
      return true;
    if (share >= 1.0) return false;
  }
}

/// Factorises H + shift I with the smallest shift that serves, searched for from a little below the
/// last one: the softest direction is then that of H.
bool EquilibriumSolver::Impl::factorizeShifted(const ClothState& state,
                                               EquilibriumSummary& summary) {
  const SparseLower& h = hessian(state, Projection::kNone);
  const double stiffest = stiffestEntry(h);
  const double first = std::max(kLeastShift, last_shift / (kShiftGrowth * kShiftGrowth));
  for (last_shift = first; last_shift < 1.0; last_shift *= kShiftGrowth) {
    ++summary.factorizations;
    if (cholesky.factorize(h, last_shift * stiffest)) return true;
  }
  return false;
}

double EquilibriumSolver::Impl::roundingOfForces(const ClothState& state) {
  return kRoundings * std::numeric_limits<double>::epsilon() *
         stiffestEntry(hessian(state, Projection::kNone)) * state.q.cwiseAbs().maxCoeff();
}

/// A step longer than a third of the sheet is never meant.
double EquilibriumSolver::Impl::fullStep(const ClothState& state) const {
  return std::min(1.0, sizeOf(state) / 3.0 / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
}

/// Energy at the state moved by alpha step, along a path that turns triangles instead of stretching
/// them; `place` is left there.
double EquilibriumSolver::Impl::energyAt(const ClothState& state, double alpha,
                                         ClothState& place) const {
  place = state;
  system.advance(place, step, alpha);
  if (straight) return system.energy(place);
  const int nodes = system.sheet().nodeCount();
  const Points3 from = state.positions(nodes);
  Eigen::Map<Points3>(place.q.data(), 3, nodes) = path.moved(from, place.positions(nodes) - from);
  return system.energy(place);
}

/// Multiplies alpha by `factor` as long as that lowers the energy `e` at `trial`.
void EquilibriumSolver::Impl::rescale(const ClothState& state, double factor, double& alpha,
                                      double& e) {
  const double longest = kLongestReach * sizeOf(state) / step.cwiseAbs().maxCoeff();
  while (factor < 1.0 || factor * alpha < longest) {
    const double next = energyAt(state, factor * alpha, other);
    if (!(next < e)) return;
    std::swap(trial, other);
    e = next;
    alpha *= factor;
  }
}

/// Takes a Newton step although the energy may rise: a chain of links that hardly stretch moves
/// along no path that lowers it at once. Returns false, back at the reference with its step, when
/// kWatchdog such steps have not paid.
bool EquilibriumSolver::Impl::tryFullStep(ClothState& state, double& energy) {
  const double slope = g.dot(step);
  if (reference.steps_since == 0 || energy <= reference.energy)
    reference = {state, energy, g, step, 0};
  const double alpha = fullStep(state);
  const double before = residual(g);
  const double e = energyAt(state, alpha, trial);
  const bool falls = e <= energy + kArmijo * alpha * slope;
  if (std::isfinite(e) && (falls || reference.steps_since < kWatchdog)) {
    std::swap(state, trial);
    energy = e;
    system.gradient(state, g);
    factors_near = residual(g) < kFactorsNear * before;
    reference.steps_since = e < reference.energy ? 0 : reference.steps_since + 1;
    return true;
  }
  state = reference.state;
  energy = reference.energy;
  g = reference.g;
  step = reference.step;
  reference.steps_since = 0;
  return false;
}

/// A step with the factors of an earlier, near state; false, and nothing changed, if that does not
/// serve any more.
bool EquilibriumSolver::Impl::stepWithOldFactors(ClothState& state, double& energy) {
  cholesky.solve(g, step);
  trial = state;
  system.advance(trial, step, -1.0);
  system.gradient(trial, trial_g);
  factors_near = residual(trial_g) < kFactorsServe * residual(g);
  if (!factors_near) return false;
  std::swap(state, trial);
  std::swap(g, trial_g);
  energy = system.energy(state);
  reference.steps_since = 0;
  return true;
}

/// Backtracks until the energy falls enough or, where rounding hides the energy's change, until the
/// residual falls. Half the step is taken where friction's corners make Newton's method jump to and
/// fro, a multiple of it where curvature is negative.
bool EquilibriumSolver::Impl::lineSearch(ClothState& state, double& energy) {
  const double slope = g.dot(step);
  double alpha = fullStep(state);
  const double rounding = 1e-13 * std::max(std::abs(energy), std::abs(slope));
  const double before = residual(g);
  const auto agreement = [&](double e) {
    return (e - energy) / (alpha * slope * (1.0 - 0.5 * alpha));
  };
  for (int k = 0; k < kMaxBacktracks; ++k, alpha *= 0.5) {
    double e = energyAt(state, alpha, trial);
    if (!std::isfinite(e)) continue;
    const double wanted = kArmijo * alpha * slope;
    const bool visible = std::abs(wanted) > rounding;
    if (visible && e > energy + wanted) continue;
    if (visible && agreement(e) < kTooLong) rescale(state, 0.5, alpha, e);
    const double agreed = agreement(e);
    if (k == 0 && used_share > 0.0 && e < energy - rounding && agreed > kTooShort)
      rescale(state, 2.0, alpha, e);
    system.gradient(trial, trial_g);
    if (!visible && !(residual(trial_g) < before) && !(e < energy + wanted)) continue;
    std::swap(state, trial);
    std::swap(g, trial_g);
    energy = e;
    reference.steps_since = 0;
    short_steps = alpha < 1.0 ? short_steps + 1 : 0;
    factors_near = used_share == 0.0 && alpha == 1.0 && residual(g) < kFactorsNear * before;
    if (k == 0 && agreed > kAsForeseen) share *= kEase;
    if (k > 0 || agreed < kInVain) share = std::min(1.0, kStiffen * share);
    return true;
  }
  return false;
}

/// The softest direction of the last Hessian, by inverse iteration with the factors of H + shift I
/// at hand.
const Eigen::VectorXd& EquilibriumSolver::Impl::softestDirection() {
  for (Eigen::Index i = 0; i < step.size(); ++i)
    step[i] = std::sin(1.0 + kGoldenAngle * static_cast<double>(i));
  for (int k = 0; k < kInverseIterations; ++k) {
    cholesky.solve(step, trial_g);
    step = trial_g.normalized();
  }
  return step;
}

/// Moves along the softest direction to lower energy.
bool EquilibriumSolver::Impl::leaveSaddle(ClothState& state, double& energy,
                                          EquilibriumSummary& summary) {
  if (!factorizeShifted(state, summary)) return false;
  const Eigen::VectorXd& v = softestDirection();
  const double unit = sizeOf(state) / v.cwiseAbs().maxCoeff();
  double best = energy;
  for (double length = kFirstEscape; length < kLastEscape; length *= 3.0) {
    bool better = false;
    for (const double sign : {1.0, -1.0}) {
      const double e = energyAt(state, sign * length * unit, trial);
      if (!std::isfinite(e) || !(e < best)) continue;
      best = e;
      std::swap(other, trial);
      better = true;
    }
    if (!better && best < energy) break;
  }
  if (!(best < energy)) return false;
  std::swap(state, other);
  energy = best;
  system.gradient(state, g);
  reference.steps_since = 0;
  return true;
}

Termination EquilibriumSolver::Impl::iterate(ClothState& state, const EquilibriumOptions& options,
                                             EquilibriumSummary& summary, Clock::time_point start) {
  const double tolerance = options.force_tolerance_N > 0.0
                               ? options.force_tolerance_N
                               : kForceToleranceOfNodeWeight * system.lightestFreeNodeWeight_N();
  double energy = system.energy(state);
  system.gradient(state, g);
  reference.steps_since = short_steps = 0;  // what an earlier solve left is of another state
  straight = false;
  share = last_shift = 0.0;
  factors_near = false;
  int saddles = 0;
  for (int k = 0;; ++k) {
    summary.residual_N = residual(g);
    summary.energy_J = energy;
    if (!std::isfinite(summary.residual_N) || !std::isfinite(energy))
      return Termination::kNotFinite;
    if (options.progress) options.progress(k, summary.residual_N);
    const bool small = summary.residual_N <= tolerance;
    if (small && !options.leave_saddles) return Termination::kConverged;
    if (k >= options.max_iterations) return Termination::kIterationLimit;
    if (options.cancelled && options.cancelled()) return Termination::kCancelled;
    if (options.time_budget_s > 0.0 &&
        std::chrono::duration<double>(Clock::now() - start).count() > options.time_budget_s) {
      return Termination::kTimeBudget;
    }
    if (small) {
      const bool stands_in = factors_near && !options.prove_stability;
      summary.proven = !stands_in;
      summary.stable = stands_in || newtonDirection(state, summary, true);
      if (summary.stable || ++saddles > kMaxSaddles || !leaveSaddle(state, energy, summary))
        return Termination::kConverged;
      continue;
    }
    ++summary.newton_steps;
    if (factors_near && stepWithOldFactors(state, energy)) continue;
    bool served = newtonDirection(state, summary, false);
    if (!served && step.cwiseAbs().maxCoeff() < kFirstEscape * sizeOf(state)) {
      // So short a step from a ridge leads along it, not off.
      served = newtonDirection(state, summary, true);
      if (!served && saddles++ < kMaxSaddles) {
        if (leaveSaddle(state, energy, summary)) continue;
        newtonDirection(state, summary, false);
      }
    }
    straight = straight || short_steps >= kCreeping || summary.newton_steps >= kPatience;
    if (served && straight && tryFullStep(state, energy)) continue;
    if (lineSearch(state, energy)) continue;
    if (!served && share < 1.0) {
      share = 1.0;
      continue;
    }
    // At the limit of rounding no step can show progress: that is convergence if forces are at that
    // limit too.
    if (served && summary.residual_N <= std::max(tolerance, roundingOfForces(state))) {
      summary.stable = summary.proven = true;
      return Termination::kConverged;
    }
    if (saddles++ < kMaxSaddles && !served && leaveSaddle(state, energy, summary)) continue;
    return Termination::kLineSearchFailed;
  }
}

void EquilibriumSolver::Impl::measureStability(const ClothState& state,
                                               EquilibriumSummary& summary) {
  const SparseLower& h = hessian(state, Projection::kNone);
  const SmallestEigenvalue pair = smallestEigenvalue(h, mass, cholesky);
  summary.lambda_min_per_s2 = pair.value;
  summary.lambda_min_residual_per_s2 = pair.residual;
  summary.stable = pair.positive_definite;
}

EquilibriumSolver::EquilibriumSolver(const ClothSystem& system)
    : impl_(std::make_unique<Impl>(system)) {}
EquilibriumSolver::EquilibriumSolver(EquilibriumSolver&&) noexcept = default;
EquilibriumSolver::~EquilibriumSolver() = default;

EquilibriumSummary EquilibriumSolver::solve(ClothState& state, const EquilibriumOptions& options) {
  const auto start = Clock::now();
  EquilibriumSummary summary;
  summary.lambda_min_per_s2 = summary.lambda_min_residual_per_s2 =
      std::numeric_limits<double>::quiet_NaN();
  const ClothState before = state;
  impl_->hold_swivel = options.hold_swivel;
  summary.termination = impl_->iterate(state, options, summary, start);
  if (summary.converged()) {
    if (!options.leave_saddles) {
      ++summary.factorizations;
      summary.stable = factorize(state);
      summary.proven = true;
    }
    if (options.compute_lambda_min) impl_->measureStability(state, summary);
  } else if (summary.termination == Termination::kNotFinite) {
    state = before;
  }
  summary.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  return summary;
}

bool EquilibriumSolver::factorize(const ClothState& state) {
  return impl_->cholesky.factorize(impl_->system.hessian(state, Projection::kNone));
}

Eigen::MatrixXd EquilibriumSolver::solveLinear(const Eigen::MatrixXd& rhs) {
  return impl_->cholesky.solve(rhs);
}

std::string describe(Termination termination) {
  switch (termination) {
    case Termination::kConverged:
      return "converged";
    case Termination::kIterationLimit:
      return "iteration limit reached";
    case Termination::kLineSearchFailed:
      return "no step lowers the energy";
    case Termination::kTimeBudget:
      return "time budget used up";
    case Termination::kCancelled:
      return "cancelled";
    case Termination::kNotFinite:
      return "energy or forces are not finite";
  }
  return "unknown";
}

}  // namespace tenter
