// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "fit_run.h"
#include "fit_tests.h"

namespace tenter {

/// Laws with couplings that meet the same data about as well as the diagonal law just fitted, as
/// material.fit["law_uncertainty"] (docs/fitting.md); null when the model has no coupled sister or
/// no test strains the membrane. What the solves cost is added to `counts`.
nlohmann::json lawAlternatives(const FitRun& fitted, const std::vector<Measurement>& measurements,
                               const FitOptions& options, const TestFactory& factory,
                               SolveCounts& counts);

}  // namespace tenter
