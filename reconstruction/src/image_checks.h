// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "match_checks.h"

namespace tenter {

/// Error unless the options can be used and the images belong together and hold a subset.
Result<void> checkPair(const GrayImage& reference, const GrayImage& deformed,
                       const CorrelateOptions& options);

/// Error unless there are points and all lie in the image.
Result<void> checkPoints(const GrayImage& reference, const std::vector<Vec2>& points);

/// Adds what is wrong with a pair of images as a whole: shares of what counts in them that are
/// saturated, and sharpness that differs.
void warnOfImages(double reference_saturated, double deformed_saturated, double reference_sharpness,
                  double deformed_sharpness, std::vector<std::string>& warnings);

}  // namespace tenter
