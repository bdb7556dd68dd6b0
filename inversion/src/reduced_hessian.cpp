// SPDX-License-Identifier: GPL-3.0-or-later
#include "reduced_hessian.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>

namespace tenter {
namespace {

/// Of the largest: inertia of a column that the others hold already.
constexpr double kDependent = 1e-10;

/// M-orthonormal columns of the same span, without those that depend on others.
void orthonormalize(Eigen::MatrixXd& columns, const Eigen::VectorXd& mass) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> inertia(columns.transpose() *
                                                               mass.asDiagonal() * columns);
  const Eigen::VectorXd& values = inertia.eigenvalues();
  Eigen::Index first = 0;
  while (first + 1 < values.size() && values[first] < kDependent * values[values.size() - 1])
    ++first;
  const Eigen::Index count = values.size() - first;
  columns = (columns * inertia.eigenvectors().rightCols(count) *
             values.tail(count).cwiseSqrt().cwiseInverse().asDiagonal())
                .eval();
}

}  // namespace

Eigen::MatrixXd unpack(const Eigen::VectorXd& packed, Eigen::Index size) {
  Eigen::MatrixXd out(size, size);
  Eigen::Index k = 0;
  for (Eigen::Index c = 0; c < size; ++c)
    for (Eigen::Index r = c; r < size; ++r, ++k)
      out(r, c) = out(c, r) = r == c ? packed[k] : packed[k] / std::numbers::sqrt2;
  return out;
}

ReducedHessian::ReducedHessian(const MetricElements& elements, Eigen::MatrixXd& columns,
                               const Eigen::VectorXd& mass)
    : elements_(elements), columns_(columns) {
  orthonormalize(columns, mass);
  elastic_ = Eigen::MatrixXd::Zero(size(), size());
  for (const MetricElement& e : elements.all()) {
    Eigen::VectorXd work = Eigen::VectorXd::Zero(size());
    for (int a = 0; a < e.node_count; ++a)
      work.noalias() +=
          columns.middleRows<3>(3 * e.nodes[a]).transpose() * e.force.segment<3>(3 * a);
    elastic_.noalias() += work * work.transpose() / e.stiffness;
  }
}

Eigen::MatrixXd ReducedHessian::hessian(const Eigen::VectorXd& z) const {
  const Eigen::MatrixXd h = elastic_ + columns_.transpose() * elements_.stiffened(z, columns_);
  return 0.5 * (h + h.transpose());
}

Eigen::MatrixXd ReducedHessian::byZ(const Eigen::MatrixXd& scale) const {
  Eigen::MatrixXd out(elements_.count(), packedSize());
  const Eigen::MatrixXd scaled = columns_ * scale.transpose();
  tbb::parallel_for(tbb::blocked_range<int>(0, elements_.count()), [&](const auto& range) {
    Eigen::MatrixXd local(12, size());
    for (int i = range.begin(); i < range.end(); ++i) {
      const MetricElement& e = elements_.all()[i];
      const int n = 3 * e.node_count;
      for (int a = 0; a < e.node_count; ++a)
        local.middleRows<3>(3 * a) = scaled.middleRows<3>(3 * e.nodes[a]);
      const Eigen::MatrixXd pushed = e.block.topLeftCorner(n, n) * local.topRows(n);
      pack(local.topRows(n).transpose() * pushed, out.row(i));
    }
  });
  return out;
}

}  // namespace tenter
