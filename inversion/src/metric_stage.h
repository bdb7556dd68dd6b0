// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>

#include "rest_newton.h"
#include "tenter/inversion/softness_proof.h"

namespace tenter {

struct MetricOptions {
  double lambda_floor_per_s2 = 0.0;  ///< What the smallest eigenvalue has to reach.
  /// Rest angles that are wished for, one a mesh edge [rad]; empty: the target's.
  Eigen::VectorXd wanted_angle_rad;
  std::function<bool()> stop;
  std::function<void(const char* stage, double lambda_min_per_s2)> progress;
};

/// Error kUsage: a material whose elements have no rest values of their own.
Result<void> checkMetricRest(const InverseShell& shell);

/// Of all rest lengths and angles within bounds (MetricElements), some for which the target is a
/// stable equilibrium with every contact force in its cone, or the proof that there are none.
struct MetricResult {
  std::optional<ElementRest> rest;     ///< Balanced; the best that was found.
  bool stable = false;                 ///< And lambda_min reaches the floor.
  std::optional<SoftnessProof> proof;  ///< None exists.
  double lambda_min_per_s2 = 0.0;
  int factorizations = 0;
};

/// Least elastic energy (to the wanted rest angles) first, which is as good as it gets where it is
/// stable (the convex choice of contact forces); else an interior-point method over all states,
/// with the Hessian kept positive on a growing space of soft motions (docs/inversion.md). Error: a
/// material without element rest, or nothing is free.
Result<MetricResult> findMetricRest(InverseShell& shell, const RestNewton& problem,
                                    const MetricOptions& options);

}  // namespace tenter
