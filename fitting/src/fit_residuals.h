// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "tenter/fitting/fit.h"
#include "tenter/fitting/fit_test.h"

namespace tenter {

/// Every frame's prediction with the parameters set last, in parallel.
std::vector<FramePrediction> predictFrames(FitTest& test, bool with_derivatives, int threads);

/// Residuals of a test from its predictions; chi2_per_dof is left to the caller, multistable frames
/// to countMultistable().
TestResidual summarizeTest(const FitTest& test, const std::vector<FramePrediction>& frames);

/// Frames whose shape depends on where the solver started ([Est12] sec. 6).
int countMultistable(FitTest& test, int threads);

nlohmann::json toJson(const TestResidual& residual);

}  // namespace tenter
