// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit_run.h"
#include "fit_statistics.h"
#include "tenter/mechanics/material.h"

namespace tenter {

/// Curves, statuses, ranges and covariance of a finished fit. @param statistics  null: no standard
/// deviations.
Material materialOf(const FitRun& run, const FitState& state, const FitSpace& space,
                    const FitStatistics* statistics, const Eigen::VectorXd& z,
                    const std::vector<Measurement>& measurements, const FitOptions& options);

/// What the fit took for granted, in sentences.
nlohmann::json assumptionsJson(const FitState& state, const std::vector<int>& refined_groups);

nlohmann::json provenanceJson(const std::vector<Measurement>& measurements,
                              const FitOptions& options);

}  // namespace tenter
