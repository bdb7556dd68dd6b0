// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Sparse>
#include <memory>

namespace tenter {

/// Cholesky factorisation of J J^T + shift I for a sparse J whose pattern does not change (CHOLMOD,
/// which never forms the product in Eigen's hands): least-norm and least-squares steps. Not safe to
/// share between threads.
class NormalFactor {
 public:
  explicit NormalFactor(const Eigen::SparseMatrix<double>& pattern);
  NormalFactor(NormalFactor&&) noexcept;
  ~NormalFactor();

  /// False when J J^T + shift I is not positive definite in floating point.
  bool factorize(const Eigen::SparseMatrix<double>& j, double shift);
  Eigen::MatrixXd solve(const Eigen::MatrixXd& rhs);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tenter
