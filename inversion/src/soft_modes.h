// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/mechanics/sparse_cholesky.h"

namespace tenter {

/// Lowest eigenpairs of H v = lambda M v, M diagonal and possibly zero in places.
struct SoftModes {
  Eigen::VectorXd values;   ///< Ascending [1/s^2]; empty if H + shift M was never definite.
  Eigen::MatrixXd vectors;  ///< M-orthonormal columns.
  int factorizations = 0;
};

/// Block inverse iteration with Rayleigh-Ritz, shifted below the spectrum; values to about 1e-3 of
/// the shifted ones, which is what cuts need.
SoftModes softModes(const SparseLower& h, const Eigen::VectorXd& mass, SparseCholesky& cholesky,
                    int count);

}  // namespace tenter
