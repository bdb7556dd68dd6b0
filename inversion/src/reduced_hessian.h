// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <numbers>

#include "metric_elements.h"

namespace tenter {

/// Lower triangle by columns, what is off the diagonal times the root of two: dot products are
/// those of the matrices.
template <class Packed>
void pack(const Eigen::MatrixXd& m, Packed&& out) {
  Eigen::Index k = 0;
  for (Eigen::Index c = 0; c < m.cols(); ++c)
    for (Eigen::Index r = c; r < m.rows(); ++r)
      out[k++] = r == c ? m(r, c) : std::numbers::sqrt2 * m(r, c);
}
Eigen::MatrixXd unpack(const Eigen::VectorXd& packed, Eigen::Index size);

/// H(z) of metric rest states, and its derivatives, between some columns of 3 a vertex.
class ReducedHessian {
 public:
  /// Makes the columns M-orthonormal, and leaves out those that depend on others.
  /// @param mass  of each coordinate.
  ReducedHessian(const MetricElements& elements, Eigen::MatrixXd& columns,
                 const Eigen::VectorXd& mass);

  Eigen::Index size() const { return columns_.cols(); }
  Eigen::Index packedSize() const { return size() * (size() + 1) / 2; }
  const Eigen::MatrixXd& elastic() const { return elastic_; }  ///< At z = 0.
  Eigen::MatrixXd hessian(const Eigen::VectorXd& z) const;
  /// One row an element: scale (columns^T dH/dz columns) scale^T, packed.
  Eigen::MatrixXd byZ(const Eigen::MatrixXd& scale) const;

 private:
  const MetricElements& elements_;
  const Eigen::MatrixXd& columns_;
  Eigen::MatrixXd elastic_;
};

}  // namespace tenter
