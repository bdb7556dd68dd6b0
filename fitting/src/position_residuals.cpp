// SPDX-License-Identifier: GPL-3.0-or-later
#include "position_residuals.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <limits>

namespace tenter {
namespace {

/// Of tracked vertices where the measurement states none [Est12] sec. 3.3.
constexpr double kDefaultSigma_m = 7.5e-5;
/// Added to the diagonal, of its mean: nodes that vertices hardly see still factorise.
constexpr double kRidge = 1e-11;

using Sparse = Eigen::SparseMatrix<double>;

double meanDiagonal(const Sparse& matrix) {
  return matrix.diagonal().sum() / static_cast<double>(matrix.rows());
}

void addEdge(int a, int b, double weight, std::vector<Eigen::Triplet<double>>& entries) {
  entries.emplace_back(a, a, weight);
  entries.emplace_back(b, b, weight);
  entries.emplace_back(a, b, -weight);
  entries.emplace_back(b, a, -weight);
}

Sparse gridLaplacian(const GridLines& lines, double weight) {
  const int columns = static_cast<int>(lines.u_lines.size()),
            rows = static_cast<int>(lines.v_lines.size());
  std::vector<Eigen::Triplet<double>> entries;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      if (i + 1 < columns) addEdge(lines.node(i, j), lines.node(i + 1, j), weight, entries);
      if (j + 1 < rows) addEdge(lines.node(i, j), lines.node(i, j + 1), weight, entries);
    }
  Sparse matrix(columns * rows, columns * rows);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Columns of a selection: all x chosen.
Sparse selection(Eigen::Index all, const std::vector<int>& chosen) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < chosen.size(); ++i)
    entries.emplace_back(chosen[i], static_cast<int>(i), 1.0);
  Sparse matrix(all, static_cast<Eigen::Index>(chosen.size()));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

double TrackedFrame::variance_m2(Eigen::Index vertex) const {
  const double stated = sigma_m.size() > 0 ? sigma_m[vertex] : 0.0;
  const double sigma = stated > 0.0 ? stated : kDefaultSigma_m;
  return sigma * sigma;
}

double TrackedFrame::weight(Eigen::Index vertex) const {
  if (!seen(vertex)) return 0.0;
  return 1.0 / std::sqrt(variance_m2(vertex) + discrepancy_m * discrepancy_m);
}

std::shared_ptr<const PositionResiduals::Factor> PositionResiduals::factorize(
    const Interpolation& p, Eigen::VectorXd weights) {
  const Sparse weighted = weights.asDiagonal() * Sparse(p);
  const Sparse all = weighted.transpose() * weighted;
  std::vector<int> seen;
  for (int node = 0; node < all.rows(); ++node)
    if (all.coeff(node, node) > 0.0) seen.push_back(node);
  const Sparse select = selection(all.rows(), seen);
  Sparse a = select.transpose() * all * select;
  const double ridge = seen.empty() ? 0.0 : kRidge * meanDiagonal(a);
  for (Eigen::Index i = 0; i < a.rows(); ++i) a.coeffRef(i, i) += ridge;

  auto factor = std::make_shared<Factor>();
  factor->weights = std::move(weights);
  if (seen.empty()) return factor;
  const Eigen::SimplicialLLT<Sparse> cholesky(a);
  factor->lower = cholesky.matrixL();
  factor->nodes.resize(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i)
    factor->nodes[cholesky.permutationP().indices()[static_cast<Eigen::Index>(i)]] = seen[i];
  return factor;
}

PositionResiduals::PositionResiduals(const Interpolation& p, const TrackedFrame& frame,
                                     const Points3& near, const PositionResiduals* like) {
  Eigen::VectorXd weights(p.rows());
  for (Eigen::Index v = 0; v < p.rows(); ++v) {
    weights[v] = frame.weight(v);
    if (weights[v] > 0.0) measured_count_ += 3;
  }
  factor_ =
      like && like->factor_->weights == weights ? like->factor_ : factorize(p, std::move(weights));
  const Factor& f = *factor_;
  const Eigen::ArrayXd squared = f.weights.array().square();
  // Only the difference from a nearby shape is solved for, so the ridge pulls by micrometres, not
  // metres.
  Eigen::MatrixX3d missing = frame.positions.transpose() - p * near.transpose();
  for (Eigen::Index v = 0; v < missing.rows(); ++v)
    if (f.weights[v] == 0.0) missing.row(v).setZero();
  const Eigen::MatrixX3d weighted = missing.array().colwise() * squared;
  const Eigen::MatrixX3d all = p.transpose() * weighted;
  Eigen::MatrixX3d b(static_cast<Eigen::Index>(f.nodes.size()), 3);
  for (std::size_t i = 0; i < f.nodes.size(); ++i)
    b.row(static_cast<Eigen::Index>(i)) = all.row(f.nodes[i]);
  if (!f.nodes.empty()) {
    f.lower.triangularView<Eigen::Lower>().solveInPlace(b);
    f.lower.transpose().triangularView<Eigen::Upper>().solveInPlace(b);
  }
  Points3 at_best = near;
  best_.resize(3, b.rows());
  for (std::size_t i = 0; i < f.nodes.size(); ++i) {
    best_.col(static_cast<Eigen::Index>(i)) =
        near.col(f.nodes[i]) + b.row(static_cast<Eigen::Index>(i)).transpose();
    at_best.col(f.nodes[i]) = best_.col(static_cast<Eigen::Index>(i));
  }
  const Eigen::MatrixX3d error = p * at_best.transpose() - frame.positions.transpose();
  for (Eigen::Index v = 0; v < error.rows(); ++v)
    if (f.weights[v] > 0.0) constant_ += squared[v] * error.row(v).squaredNorm();
}

Eigen::MatrixXd PositionResiduals::reduced(const Eigen::Ref<const Points3>& nodes) const {
  Eigen::MatrixXd chosen(3, static_cast<Eigen::Index>(factor_->nodes.size()));
  for (std::size_t i = 0; i < factor_->nodes.size(); ++i)
    chosen.col(static_cast<Eigen::Index>(i)) = nodes.col(factor_->nodes[i]);
  return chosen;
}

void PositionResiduals::whiten(Eigen::MatrixXd& rows) const {
  if (mode_basis_.cols() > 0)
    rows -= mode_basis_ * (mode_removed_.asDiagonal() * (mode_basis_.transpose() * rows).eval());
}

Eigen::VectorXd PositionResiduals::residuals(const Eigen::Ref<const Points3>& nodes) const {
  Eigen::MatrixXd rows = ((reduced(nodes) - best_) * factor_->lower).reshaped();
  whiten(rows);
  return rows.col(0);
}

Eigen::MatrixXd PositionResiduals::derivative(const Eigen::MatrixXd& positions_by) const {
  Eigen::MatrixXd rows(size(), positions_by.cols());
  for (Eigen::Index j = 0; j < positions_by.cols(); ++j) {
    const Eigen::Map<const Points3> column(positions_by.col(j).data(), 3, positions_by.rows() / 3);
    rows.col(j) = (reduced(column) * factor_->lower).reshaped();
  }
  whiten(rows);
  return rows;
}

void PositionResiduals::setCommonErrors(const Eigen::MatrixXd& modes) {
  mode_basis_.resize(0, 0);
  const Eigen::MatrixXd e = derivative(modes);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(e.transpose() * e);
  // Modes below a millionth of the noise change nothing and would only divide by zero.
  const Eigen::Index first = (eigen.eigenvalues().array() < 1e-6).count();
  const Eigen::Index count = e.cols() - first;
  const Eigen::VectorXd squared = eigen.eigenvalues().tail(count);
  mode_basis_ =
      e * eigen.eigenvectors().rightCols(count) * squared.cwiseSqrt().cwiseInverse().asDiagonal();
  mode_removed_ = 1.0 - (1.0 + squared.array()).sqrt().inverse();
}

void fillMeasuredShape(const Interpolation& p, const TrackedFrame& frame, const GridLines& lines,
                       const Points3& rest, const std::vector<bool>& held, Points3& nodes,
                       double smoothing) {
  const bool tracked = frame.positions.cols() == p.rows();
  Eigen::VectorXd seen = Eigen::VectorXd::Zero(p.rows());
  Eigen::MatrixX3d places = Eigen::MatrixX3d::Zero(p.rows(), 3);
  for (Eigen::Index v = 0; tracked && v < p.rows(); ++v)
    if (frame.seen(v)) {
      seen[v] = 1.0;
      places.row(v) = frame.positions.col(v).transpose();
    }
  const Sparse weighted = seen.asDiagonal() * Sparse(p);
  const Sparse normal = weighted.transpose() * weighted;
  const double mean = meanDiagonal(normal);
  const Sparse laplacian = gridLaplacian(lines, mean > 0.0 ? smoothing * mean : 1.0);
  const Sparse all = normal + laplacian;
  std::vector<int> free;
  Eigen::MatrixX3d known = Eigen::MatrixX3d::Zero(nodes.cols(), 3);
  for (int node = 0; node < static_cast<int>(nodes.cols()); ++node) {
    if (held[node])
      known.row(node) = nodes.col(node).transpose();
    else
      free.push_back(node);
  }
  const Sparse select = selection(all.rows(), free);
  const Eigen::MatrixX3d wanted = weighted.transpose() * places + laplacian * rest.transpose();
  const Eigen::MatrixX3d right = select.transpose() * (wanted - all * known);
  const Eigen::SimplicialLDLT<Sparse> cholesky(select.transpose() * all * select);
  if (free.empty() || cholesky.info() != Eigen::Success) return;
  const Eigen::MatrixX3d solution = cholesky.solve(right);
  for (std::size_t i = 0; i < free.size(); ++i)
    nodes.col(free[i]) = solution.row(static_cast<Eigen::Index>(i)).transpose();
}

void addPositionMisfit(const Interpolation& p, const TrackedFrame& frame,
                       const Eigen::Ref<const Points3>& nodes, PositionMisfit& sums) {
  if (frame.positions.cols() != p.rows()) return;
  const Eigen::MatrixX3d error = p * nodes.transpose() - frame.positions.transpose();
  for (Eigen::Index v = 0; v < error.rows(); ++v) {
    if (!frame.seen(v)) continue;
    sums.squares_m2 += error.row(v).squaredNorm();
    sums.noise_m2 += 3.0 * frame.variance_m2(v);
    sums.coordinates += 3;
  }
}

double positionRms(const Interpolation& p, const TrackedFrame& frame,
                   const Eigen::Ref<const Points3>& nodes) {
  PositionMisfit sums;
  addPositionMisfit(p, frame, nodes, sums);
  return sums.coordinates > 0
             ? std::sqrt(3.0 * sums.squares_m2 / static_cast<double>(sums.coordinates))
             : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace tenter
