// SPDX-License-Identifier: GPL-3.0-or-later
#include "soft_modes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>

namespace tenter {
namespace {

constexpr int kMaxIterations = 25;
constexpr int kGuards = 4;  ///< Vectors beside those that are wanted: the last ones lag.
constexpr double kRelativeChange = 1e-3;
constexpr unsigned kSeed = 20260104;
constexpr double kFirstShift = 1e-9, kShiftGrowth = 3.0, kLastShift = 1e2;

/// A shift that makes H + shift M definite, about as small as serves; negative if none does.
double shiftOf(const SparseLower& h, const Eigen::VectorXd& mass, SparseCholesky& cholesky,
               int& factorizations) {
  ++factorizations;
  if (cholesky.factorize(h)) return 0.0;
  double stiffest = 0.0;
  for (int c = 0; c < h.size; ++c)
    if (mass[c] > 0.0)
      stiffest = std::max(stiffest, std::abs(h.value[h.column_begin[c]]) / mass[c]);
  for (double shift = kFirstShift * stiffest; shift < kLastShift * stiffest;
       shift *= kShiftGrowth) {
    ++factorizations;
    if (cholesky.factorize(h, shift, &mass)) return shift;
  }
  return -1.0;
}

}  // namespace

SoftModes softModes(const SparseLower& h, const Eigen::VectorXd& mass, SparseCholesky& cholesky,
                    int count) {
  SoftModes out;
  const double shift = shiftOf(h, mass, cholesky, out.factorizations);
  if (shift < 0.0) return out;
  const int block = std::min(count + kGuards, h.size);
  count = std::min(count, block);
  std::mt19937 random(kSeed);
  Eigen::MatrixXd x(h.size, block);
  for (double& v : x.reshaped()) v = static_cast<double>(random()) / 4294967296.0 - 0.5;
  Eigen::VectorXd last = Eigen::VectorXd::Zero(count);
  for (int k = 0; k < kMaxIterations; ++k) {
    const Eigen::MatrixXd mx = mass.asDiagonal() * x;
    const Eigen::MatrixXd y = cholesky.solve(mx);
    const Eigen::MatrixXd stiffness = y.transpose() * mx;
    const Eigen::MatrixXd inertia = y.transpose() * mass.asDiagonal() * y;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> small(
        0.5 * (stiffness + stiffness.transpose()), inertia);
    if (small.info() != Eigen::Success) return out;
    x = y * small.eigenvectors();
    const Eigen::VectorXd values = small.eigenvalues().head(count);
    out.values = values.array() - shift;
    out.vectors = x.leftCols(count);
    if (k > 0 && ((values - last).cwiseAbs().array() <= kRelativeChange * values.array()).all())
      break;
    last = values;
  }
  return out;
}

}  // namespace tenter
