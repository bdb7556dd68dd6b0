// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "rest_newton.h"

namespace tenter {

struct ReferenceOptions {
  std::function<bool()> stop;
  std::function<void(double lambda, int drapes, double cost)> progress;
};

struct ReferenceResult {
  bool finished = false;  ///< The schedule of lambda came to its end.
  int drapes = 0;
};

/// The algorithm of [Inv18], for comparison: for lambda = 1000, 500, ... 0.1 and then 0, first the
/// rest shape whose drape under E + lambda/2 |x - target|^2, contacts held, is nearest to the
/// target (eq. 20, by the adjoint method and BFGS), then the least distance of the forces there
/// from the friction cones (eq. 34, by BFGS). `unknowns` starts at the target and is the best so
/// far.
ReferenceResult invertByReference(const InverseShell& shell, const RestNewton& problem,
                                  double friction_share, RestUnknowns& unknowns,
                                  const ReferenceOptions& options);

}  // namespace tenter
