// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <ceres/ceres.h>

#include <memory>

#include "bundle.h"

namespace tenter {

/// The least-squares problem of a bundle, over the bundle's own numbers.
/// Precondition: the bundle outlives it and its vectors are not resized.
std::unique_ptr<ceres::Problem> bundleProblem(Bundle& bundle, const BundleOptions& options);

}  // namespace tenter
