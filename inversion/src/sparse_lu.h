// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Sparse>
#include <memory>

namespace tenter {

/// LU factorisation of a sparse square matrix whose pattern does not change (UMFPACK): analysed
/// once, factorised many times. Not safe to share between threads.
class SparseLu {
 public:
  SparseLu();
  SparseLu(SparseLu&&) noexcept;
  SparseLu& operator=(SparseLu&&) noexcept;
  ~SparseLu();

  /// False when it is singular or not finite. Column-compressed; its pattern is that of the first
  /// call.
  bool factorize(const Eigen::SparseMatrix<double>& matrix);
  /// With the last successful factorisation, of the matrix given there; false if that fails.
  bool solve(const Eigen::VectorXd& rhs, Eigen::VectorXd& x) const;
  bool solveTransposed(const Eigen::VectorXd& rhs, Eigen::VectorXd& x) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tenter
