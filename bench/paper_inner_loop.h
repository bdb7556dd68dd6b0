// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <memory>

#include "tenter/fitting/fit_test.h"

namespace tenter::bench {

/// What [Est12]'s inner loop has cost, over all frames and threads.
struct PaperCounts {
  std::atomic<long> equilibria{0}, steps{0}, gradient_steps{0}, unconverged{0};
  std::atomic<double> cpu_seconds{0.0};  ///< Summed over threads.
};

/// One cloth measurement whose equilibria are found as [Est12] sec. 5.1 says: always from the
/// measured shape, additive Levenberg-Marquardt on the force with conjugate gradients, until the
/// norm of all forces is below 10 uN; derivatives by one conjugate-gradient solve a parameter.
/// Residuals are those of `judge`, which solves the frame again, uncounted.
Result<std::unique_ptr<FitTest>> makePaperTest(const Measurement& measurement,
                                               const ClothModel& model,
                                               const FitTestOptions& options,
                                               std::unique_ptr<FitTest> judge, PaperCounts& counts);

}  // namespace tenter::bench
