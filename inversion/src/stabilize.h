// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "contact_forces.h"

namespace tenter {

struct StabilizeOptions {
  double lambda_floor_per_s2 = 0.0;  ///< What the smallest eigenvalue has to reach.
  int max_rounds = 40;
  int modes = 6;
  ConeMargin margin;         ///< Cones that contact forces stay in.
  RestNewtonOptions newton;  ///< Forces are balanced again with it after every step.
  std::function<bool()> stop;
  std::function<void(int round, double lambda_min)> progress;
};

struct StabilizeResult {
  bool stable = false;
  int rounds = 0, factorizations = 0;
  double lambda_min_per_s2 = 0.0;
};

/// Moves a balanced rest shape to one whose target pose is stable, by what is free to choose: the
/// contact forces inside their cones and the rest positions of fixed vertices. Each round
/// linearises the eigenvalues below the floor, d lambda_k = v_k' (dH) v_k, along the balanced rest
/// shapes, takes the least change that raises them, and balances again. Contacts count as held. A
/// failed call leaves the best that was found.
StabilizeResult stabilize(const InverseShell& shell, RestNewton& problem, RestUnknowns& unknowns,
                          Points3& forces, const StabilizeOptions& options);

}  // namespace tenter
