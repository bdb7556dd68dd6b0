// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/mechanics/sparse_cholesky.h"

namespace tenter {

/// Smallest eigenvalue of H v = lambda M v [1/s^2], M diagonal and possibly zero in places.
struct SmallestEigenvalue {
  double value = 0.0;
  double residual = 0.0;  ///< ||M^-1 H v - lambda v||, M-norm, v normalised: a bound on the
                          ///< distance to an eigenvalue.
  bool positive_definite = false;
  Eigen::VectorXd vector;
};

/// Block inverse iteration with Rayleigh-Ritz; indefinite matrices are shifted until they can be
/// factorised.
SmallestEigenvalue smallestEigenvalue(const SparseLower& h, const Eigen::VectorXd& mass,
                                      SparseCholesky& cholesky);

}  // namespace tenter
