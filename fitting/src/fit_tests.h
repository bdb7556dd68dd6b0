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

/// A measurement that outlives the test, without a copy: tracked vertices fill a hundred megabytes.
inline std::shared_ptr<const Measurement> borrowed(const Measurement& measurement) {
  return {std::shared_ptr<const void>(), &measurement};
}

/// fitMaterial with tests of another making: what the unit tests run on analytic fakes.
Result<FitResult> fitWithTests(const std::vector<Measurement>& measurements,
                               const FitOptions& options, const TestFactory& factory);

/// One test a measurement, or the first error.
Result<std::vector<std::unique_ptr<FitTest>>> makeTests(
    const std::vector<Measurement>& measurements, const ClothModel& model,
    const FitTestOptions& options, const TestFactory& factory);

}  // namespace tenter
