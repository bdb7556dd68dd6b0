// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/equilibrium.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "smallest_eigenvalue.h"
#include "sparse_cholesky.h"

namespace tenter {
namespace {

constexpr double kForceToleranceOfNodeWeight = 1e-4;
/// Forces are resolved to this many roundings of the positions, times the stiffest degree of
/// freedom.
constexpr double kRoundings = 8.0;
/// Smallest shift of an indefinite Hessian, as a share of its stiffest entry; how it eases after a
/// full step and stiffens after one that failed.
constexpr double kLeastShift = 1e-9;
constexpr double kEase = 0.15, kStiffen = 4.0;
constexpr double kArmijo = 1e-4;
constexpr int kMaxBacktracks = 40;
constexpr int kMaxSaddles = 20;
constexpr int kInverseIterations = 6;
constexpr double kGoldenAngle = 2.399963;  ///< Starts inverse iteration without a symmetry.
/// Moves off a saddle, as shares of the sheet's size.
constexpr double kFirstEscape = 1e-5, kLastEscape = 0.2;
constexpr int kWatchdog = 4;

using Clock = std::chrono::steady_clock;

}  // namespace

struct EquilibriumSolver::Impl {
  explicit Impl(const ClothSystem& s)
      : system(s), cholesky(s.hessian(s.restState(), Projection::kNone)), mass(s.dofMass()) {
    g.resize(s.dofCount());
    trial_g.resize(s.dofCount());
    step.resize(s.dofCount());
  }

  const ClothSystem& system;
  SparseCholesky cholesky;
  Eigen::VectorXd mass;
  double shift = 0.0;  ///< Of the last indefinite Hessian [N/m].
  Eigen::VectorXd g, trial_g, step;
  ClothState trial, escaped;
  /// Last state from which the energy has to fall, and the Newton step there (watchdog).
  struct Reference {
    ClothState state;
    double energy = 0.0;
    Eigen::VectorXd g, step;
    int steps_since = 0;
  } reference;

  double roundingOfForces(const ClothState& state) const;
  double residual(const Eigen::VectorXd& gradient) const { return gradient.cwiseAbs().maxCoeff(); }
  bool newtonDirection(const ClothState& state, EquilibriumSummary& summary);
  double fullStep(const ClothState& state) const;
  bool lineSearch(ClothState& state, double& energy);
  bool tryFullStep(ClothState& state, double& energy);
  const Eigen::VectorXd& softestDirection();
  bool leaveSaddle(ClothState& state, double& energy);
  void measureStability(const ClothState& state, EquilibriumSummary& summary);
  Termination iterate(ClothState& state, const EquilibriumOptions& options,
                      EquilibriumSummary& summary, Clock::time_point start);
};

/// step = -(H + shift I)^-1 g with the exact Hessian H: no shift if H is positive definite,
/// otherwise the smallest that makes it so, searched for from where the last one was. All
/// coordinates are lengths, so one shift [N/m] serves all; being of the size of the softest
/// negative stiffness, it leaves the stiff directions alone. Returns whether H itself served.
bool EquilibriumSolver::Impl::newtonDirection(const ClothState& state,
                                              EquilibriumSummary& summary) {
  const SparseLower& h = system.hessian(state, Projection::kNone);
  ++summary.factorizations;
  const bool exact = cholesky.factorize(h);
  if (!exact) {
    double stiffest = 0.0;
    for (int c = 0; c < h.size; ++c) stiffest = std::max(stiffest, h.value[h.column_begin[c]]);
    const double least = kLeastShift * stiffest;
    for (shift = std::max(shift, least);; shift *= kStiffen) {
      ++summary.factorizations;
      if (cholesky.factorize(h, shift)) break;
      if (shift > stiffest || !std::isfinite(stiffest)) {
        step = -g / std::max(stiffest, std::numeric_limits<double>::min());
        return false;
      }
    }
  }
  cholesky.solve(g, step);
  step = -step;
  return exact;
}

double EquilibriumSolver::Impl::roundingOfForces(const ClothState& state) const {
  const SparseLower& h = system.hessian(state, Projection::kNone);
  double stiffest = 0.0;
  for (int c = 0; c < h.size; ++c) stiffest = std::max(stiffest, h.value[h.column_begin[c]]);
  return kRoundings * std::numeric_limits<double>::epsilon() * stiffest *
         state.q.cwiseAbs().maxCoeff();
}

/// A step longer than a third of the sheet is never meant.
double EquilibriumSolver::Impl::fullStep(const ClothState& state) const {
  const double size = std::max(state.q.cwiseAbs().maxCoeff(), 1e-3);
  return std::min(1.0, size / 3.0 / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
}

/// Takes a Newton step although the energy may rise: bending an almost inextensible sheet along a
/// straight step stretches it, and the next step takes that out. Returns false, back at the
/// reference with its step, when kWatchdog such steps have not paid.
bool EquilibriumSolver::Impl::tryFullStep(ClothState& state, double& energy) {
  const double slope = g.dot(step);
  if (reference.steps_since == 0 || energy <= reference.energy) {
    reference = {state, energy, g, step, 0};
  }
  trial = state;
  const double alpha = fullStep(state);
  system.advance(trial, step, alpha);
  const double e = system.energy(trial);
  const bool falls = e <= energy + kArmijo * alpha * slope;
  if (std::isfinite(e) && (falls || reference.steps_since < kWatchdog)) {
    std::swap(state, trial);
    energy = e;
    system.gradient(state, g);
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

/// Backtracks until the energy falls enough or, where rounding hides the energy's change, until the
/// residual falls.
bool EquilibriumSolver::Impl::lineSearch(ClothState& state, double& energy) {
  const double slope = g.dot(step);
  double alpha = fullStep(state);
  const double rounding = 1e-13 * std::max(std::abs(energy), std::abs(slope));
  const double before = residual(g);
  for (int k = 0; k < kMaxBacktracks; ++k, alpha *= 0.5) {
    trial = state;
    system.advance(trial, step, alpha);
    const double e = system.energy(trial);
    if (!std::isfinite(e)) continue;
    const double wanted = kArmijo * alpha * slope;
    const bool visible = std::abs(wanted) > rounding;
    if (visible && e > energy + wanted) continue;
    system.gradient(trial, trial_g);
    if (!visible && !(residual(trial_g) < before) && !(e < energy + wanted)) continue;
    std::swap(state, trial);
    std::swap(g, trial_g);
    energy = e;
    shift *= k == 0 ? kEase : kStiffen;
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

/// Moves along the softest direction to lower energy. `step` and the factors are those of the
/// shifted Hessian there.
bool EquilibriumSolver::Impl::leaveSaddle(ClothState& state, double& energy) {
  const Eigen::VectorXd& v = softestDirection();
  const double size = std::max(state.q.cwiseAbs().maxCoeff(), 1e-3);
  const double unit = size / v.cwiseAbs().maxCoeff();
  double best = energy;
  for (double length = kFirstEscape; length < kLastEscape; length *= 3.0) {
    bool better = false;
    for (const double sign : {1.0, -1.0}) {
      trial = state;
      system.advance(trial, v, sign * length * unit);
      const double e = system.energy(trial);
      if (!std::isfinite(e) || !(e < best)) continue;
      best = e;
      std::swap(escaped, trial);
      better = true;
    }
    if (!better && best < energy) break;
  }
  if (!(best < energy)) return false;
  std::swap(state, escaped);
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
  reference.steps_since = 0;  // whatever an earlier solve left there is of another state
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
      summary.stable = newtonDirection(state, summary);
      if (summary.stable || ++saddles > kMaxSaddles || !leaveSaddle(state, energy))
        return Termination::kConverged;
      continue;
    }
    const bool exact = newtonDirection(state, summary);
    ++summary.newton_steps;
    if (exact && tryFullStep(state, energy)) continue;
    if (lineSearch(state, energy)) continue;
    // At the limit of rounding no step can show progress: that is convergence if forces are at that
    // limit too.
    if (exact && summary.residual_N <= std::max(tolerance, roundingOfForces(state))) {
      summary.stable = true;
      return Termination::kConverged;
    }
    if (saddles++ < kMaxSaddles && !exact && leaveSaddle(state, energy)) continue;
    return Termination::kLineSearchFailed;
  }
}

void EquilibriumSolver::Impl::measureStability(const ClothState& state,
                                               EquilibriumSummary& summary) {
  const SparseLower& h = system.hessian(state, Projection::kNone);
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
  summary.termination = impl_->iterate(state, options, summary, start);
  if (summary.converged()) {
    if (!options.leave_saddles) {
      ++summary.factorizations;
      summary.stable = factorize(state);
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
