// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "tenter/fitting/fit.h"
#include "tenter/fitting/fit_test.h"

namespace tenter {

using TestFactory = std::function<Result<std::unique_ptr<FitTest>>(
    const Measurement&, const ClothModel&, const FitTestOptions&)>;

/// fitMaterial with tests of another making: what the unit tests run on analytic fakes.
Result<FitResult> fitWithTests(const std::vector<Measurement>& measurements,
                               const FitOptions& options, const TestFactory& factory);

/// One test a measurement, or the first error.
Result<std::vector<std::unique_ptr<FitTest>>> makeTests(
    const std::vector<Measurement>& measurements, const ClothModel& model,
    const FitTestOptions& options, const TestFactory& factory);

}  // namespace tenter
