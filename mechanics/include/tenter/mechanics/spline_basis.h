// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "tenter/core/types.h"
#include "tenter/mechanics/stiffness_curve.h"

namespace tenter {

/// The linear space in which a fit looks for k(e): cubic B-splines, twice continuously
/// differentiable, on given knots. Non-negative coefficients give k >= 0 on the *whole* range, not
/// just at the knots, so bounds are all a solver needs. One knot: one coefficient (constant). n >=
/// 2 knots: n + 2 coefficients; even: n + 1 (the slope at 0 vanishes).
class SplineBasis {
 public:
  static SplineBasis constant(bool even = false);
  /// Precondition: strictly increasing; even: starts at 0.
  static SplineBasis onKnots(std::vector<double> knots, bool even);

  int size() const { return size_; }
  bool even() const { return even_; }
  const std::vector<double>& knots() const { return knots_; }

  /// Basis functions N_j(e), constant beyond the ends, mirrored if even; they sum to 1. `values`
  /// has size() entries. sigma(e) = sum_j c_j N_j(e) e, so d sigma / d c_j = N_j(e) e.  Never
  /// allocates.
  void evaluate(double strain, Eigen::Ref<Eigen::VectorXd> values) const;

  /// The same without the zeros: N_j for j = first .. first + count - 1. What inner loops use.
  struct Local {
    int first = 0, count = 0;
    std::array<double, 4> values{};
  };
  Local local(double strain) const;

  /// Knots, values and tangents of sum_j c_j N_j.
  StiffnessCurve curve(const Eigen::VectorXd& coefficients) const;

  /// knots x size(): maps coefficients to stiffness at the knots.
  Eigen::MatrixXd knotValueMap() const;

  /// Coefficients of a curve that lies in this space on the range of the knots (to rounding);
  /// otherwise those of the least squares fit to its values there, which may be negative where the
  /// curve is not.
  Eigen::VectorXd coefficientsOf(const StiffnessCurve& curve) const;

  /// R in c^T R c = sum of squared second differences of c over its Greville abscissae, each
  /// weighted by its share of the range (range scaled to 1, so about the integral of k''^2). size()
  /// x size(), positive semi-definite, zero for one knot.
  Eigen::MatrixXd roughness() const;

 private:
  SplineBasis(std::vector<double> knots, bool even);
  int unmerged(double strain, std::array<double, 4>& values) const;
  Eigen::MatrixXd merging() const;

  std::vector<double> knots_;
  std::vector<double> extended_;  ///< Clamped knot vector.
  int size_ = 1;
  bool even_ = false;
};

}  // namespace tenter
