// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "force_balance.h"

namespace tenter {

struct StabilizeOptions {
  double lambda_floor_per_s2 = 0.0;  ///< What the smallest eigenvalue has to reach.
  int max_rounds = 40;
  int modes = 6;
  BalanceOptions balance;  ///< Forces are balanced again with it after every step.
  std::function<bool()> stop;
  std::function<void(int round, double lambda_min)> progress;
};

struct StabilizeResult {
  bool stable = false;
  int rounds = 0, factorizations = 0;
  double lambda_min_per_s2 = 0.0;
};

/// Moves a balanced rest shape to one whose target pose is stable: each round linearises the
/// eigenvalues below the floor in the unknowns, d lambda_k = v_k' (dH) v_k, takes the least-norm
/// step that raises them and keeps the forces, and balances again. Contacts count as held. A failed
/// call leaves the best that was found.
StabilizeResult stabilize(const InverseShell& shell, ForceBalance& balance, RestUnknowns& unknowns,
                          const StabilizeOptions& options);

}  // namespace tenter
