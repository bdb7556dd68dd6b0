// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "tenter/mechanics/cloth_system.h"

namespace tenter {

struct EquilibriumOptions {
  int max_iterations = 200;
  /// Largest force on a degree of freedom at convergence [N]; 0: 1e-4 of the lightest free node's
  /// weight.
  double force_tolerance_N = 0.0;
  /// Leave a saddle along its negative direction and go on; otherwise it is only reported.
  bool leave_saddles = true;
  /// Prove stability with the Hessian at the end itself. Otherwise factors of one so near that
  /// steps with them converge fast may stand in: half the factorisations, no proof.
  bool prove_stability = true;
  /// Judge a sheet that nothing stops from turning about gravity's line through its supports with
  /// one degree of freedom held: stable but for that. Otherwise rounding decides.
  bool hold_swivel = false;
  /// Compute the smallest eigenvalue of H v = lambda M v [1/s^2].
  bool compute_lambda_min = false;
  double time_budget_s = 0.0;       ///< 0: none.
  std::function<bool()> cancelled;  ///< Polled once an iteration.
  std::function<void(int iteration, double residual_N)> progress;
};

enum class Termination {
  kConverged,
  kIterationLimit,
  kLineSearchFailed,
  kTimeBudget,
  kCancelled,
  kNotFinite
};

struct EquilibriumSummary {
  Termination termination = Termination::kIterationLimit;
  bool stable = false;  ///< No negative pivot in the Hessian at the end, or near it.
  bool proven = false;  ///< The factors at hand are of the Hessian at the end.
  int newton_steps = 0;
  int factorizations = 0;
  double residual_N = 0.0;  ///< Largest force on a degree of freedom.
  double energy_J = 0.0;
  double lambda_min_per_s2 = 0.0;           ///< NaN if not computed.
  double lambda_min_residual_per_s2 = 0.0;  ///< Residual of that eigenpair.
  double seconds = 0.0;
  bool converged() const { return termination == Termination::kConverged; }
};

/// Newton's method on the energy with the exact Hessian, mixed with as little as serves of its
/// element-wise projection where it is indefinite; sparse Cholesky analysed once per solver and
/// reused. After a failed solve the state is the best so far, and the summary says why it failed.
class EquilibriumSolver {
 public:
  explicit EquilibriumSolver(const ClothSystem& system);
  EquilibriumSolver(EquilibriumSolver&&) noexcept;
  ~EquilibriumSolver();

  EquilibriumSummary solve(ClothState& state, const EquilibriumOptions& options = {});

  /// Factorises the exact Hessian at `state`; false if it is not positive definite.
  bool factorize(const ClothState& state);
  /// Solves H X = B with the last factorisation (of solve(), at or near its end, or factorize()).
  Eigen::MatrixXd solveLinear(const Eigen::MatrixXd& rhs);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

std::string describe(Termination termination);

}  // namespace tenter
