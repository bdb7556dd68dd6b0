// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>

namespace tenter {

/// Generalised minimal residuals [Saad86] without restart for A x = b, A given by its products.
/// Returns after `max_products`, or when the residual is below `tolerance` times |b|.
Eigen::VectorXd solveGmres(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& product,
                           const Eigen::VectorXd& b, int max_products, double tolerance);

}  // namespace tenter
