// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>

#include "tenter/mechanics/cloth_system.h"

namespace tenter {

/// Cholesky factorisation of a sparse symmetric matrix whose pattern does not change (CHOLMOD):
/// ordered and analysed once, factorised many times. Not safe to share between threads.
class SparseCholesky {
 public:
  explicit SparseCholesky(const SparseLower& pattern);
  SparseCholesky(SparseCholesky&&) noexcept;
  ~SparseCholesky();

  /// Factorises matrix + shift * diag(weights); null weights are ones. False when it is not
  /// positive definite.
  bool factorize(const SparseLower& matrix, double shift = 0.0,
                 const Eigen::VectorXd* weights = nullptr);
  /// Solves with the last successful factorisation.
  void solve(const Eigen::VectorXd& rhs, Eigen::VectorXd& x);
  Eigen::MatrixXd solve(const Eigen::MatrixXd& rhs);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// y = H x for a lower triangle.
void multiply(const SparseLower& h, const Eigen::VectorXd& x, Eigen::VectorXd& y);

}  // namespace tenter
