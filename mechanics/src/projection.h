// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

namespace tenter {

/// Nearest positive semi-definite matrix, in place; never allocates for types of bounded size.
template <class Matrix>
void clampEigenvalues(Matrix* block) {
  // A Cholesky factorisation that succeeds is an order of magnitude cheaper than eigenvalues.
  const Eigen::LLT<Matrix> cholesky(*block);
  if (cholesky.info() == Eigen::Success) return;
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(*block);
  const Matrix scaled = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal();
  *block = (scaled * solver.eigenvectors().transpose()).eval();
  *block = (0.5 * (*block + block->transpose())).eval();
}

}  // namespace tenter
