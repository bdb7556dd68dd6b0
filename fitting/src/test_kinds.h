// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "tenter/fitting/fit_test.h"

namespace tenter {

/// The kinds of tests, one file each; fit_test_registry.cpp lists them.
Result<std::unique_ptr<FitTest>> makeTensileTest(std::shared_ptr<const Measurement> measurement,
                                                 const ClothModel& model,
                                                 const FitTestOptions& options);
Result<std::unique_ptr<FitTest>> makeCantileverTest(std::shared_ptr<const Measurement> measurement,
                                                    const ClothModel& model,
                                                    const FitTestOptions& options);
Result<std::unique_ptr<FitTest>> makeClothTest(std::shared_ptr<const Measurement> measurement,
                                               const ClothModel& model,
                                               const FitTestOptions& options);

}  // namespace tenter
