// SPDX-License-Identifier: GPL-3.0-or-later
#include "smallest_eigenvalue.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace tenter {
namespace {

constexpr int kBlock = 6;
constexpr int kMaxIterations = 200;
constexpr double kRelativeResidual = 1e-4;
constexpr unsigned kSeed = 20260101;

/// Smallest shift (by doubling) that makes H + shift M positive definite; 0 if H is.
double shiftToDefinite(const SparseLower& h, const Eigen::VectorXd& mass,
                       SparseCholesky& cholesky) {
  if (cholesky.factorize(h)) return 0.0;
  double scale = 0.0;
  for (int c = 0; c < h.size; ++c) {
    if (mass[c] > 0.0) scale = std::max(scale, std::abs(h.value[h.column_begin[c]]) / mass[c]);
  }
  for (double shift = 1e-12 * scale; shift < 1e3 * scale; shift *= 2.0) {
    if (cholesky.factorize(h, shift, &mass)) return shift;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

SmallestEigenvalue smallestEigenvalue(const SparseLower& h, const Eigen::VectorXd& mass,
                                      SparseCholesky& cholesky) {
  SmallestEigenvalue best;
  const double shift = shiftToDefinite(h, mass, cholesky);
  best.positive_definite = shift == 0.0;
  if (!std::isfinite(shift)) {
    best.value = -std::numeric_limits<double>::infinity();
    return best;
  }
  const int n = h.size;
  const int block = std::min(kBlock, n);
  std::mt19937 random(kSeed);
  Eigen::MatrixXd x(n, block);
  for (double& v : x.reshaped()) v = static_cast<double>(random()) / 4294967296.0 - 0.5;

  for (int k = 0; k < kMaxIterations; ++k) {
    // (H + shift M) y = M x, so on span(y) the small problem (y'Mx) c = theta (y'My) c approximates
    // the lowest eigenpairs.
    const Eigen::MatrixXd mx = mass.asDiagonal() * x;
    Eigen::MatrixXd y = cholesky.solve(mx);
    const Eigen::MatrixXd stiffness = y.transpose() * mx;
    const Eigen::MatrixXd inertia = y.transpose() * mass.asDiagonal() * y;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> small(
        0.5 * (stiffness + stiffness.transpose()), inertia);
    if (small.info() != Eigen::Success) break;
    const Eigen::VectorXd v = y * small.eigenvectors().col(0);  // M-orthonormal
    const double theta = small.eigenvalues()[0];
    const Eigen::VectorXd defect = x * small.eigenvectors().col(0) - theta * v;
    best.value = theta - shift;
    best.residual = std::sqrt(defect.dot(mass.cwiseProduct(defect)));
    best.vector = v;
    if (best.residual <= kRelativeResidual * std::max(std::abs(best.value), 1e-12 * theta)) break;
    x = y * small.eigenvectors();
  }
  return best;
}

}  // namespace tenter
