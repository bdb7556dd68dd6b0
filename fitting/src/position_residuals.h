// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <memory>
#include <vector>

#include "cloth_replica.h"

namespace tenter {

/// Tracked vertices of one frame; a view of the measurement.
struct TrackedFrame {
  const Points3& positions;                ///< 3 x vertices.
  const Eigen::VectorXd& sigma_m;          ///< Per vertex; empty or zero: [Est12] sec. 3.3.
  const std::vector<std::uint8_t>& valid;  ///< Per vertex; empty: all.
  double discrepancy_m = 0.0;  ///< Of a law that cannot follow: adds to every sigma, squared.

  bool seen(Eigen::Index vertex) const { return valid.empty() || valid[vertex] != 0; }
  double variance_m2(Eigen::Index vertex) const;  ///< Per axis, of the noise alone.
  /// 1 / standard deviation, discrepancy included [1/m]; 0 if not seen.
  double weight(Eigen::Index vertex) const;
};

/// The residuals of thousands of vertices as few residuals at the nodes, without loss: with the
/// interpolation P, W = 1/sigma and A = P^T W^2 P = L L^T,   |W (P x - y)|^2 = |L^T (x - x_best)|^2
/// + constant   (docs/fitting-tests.md).
class PositionResiduals {
 public:
  /// @param near  some configuration near the measured one; only rounding depends on it.
  /// @param like  another frame of the replica: its factor serves if weights are equal; may be
  /// null.
  PositionResiduals(const Interpolation& interpolation, const TrackedFrame& frame,
                    const Points3& near, const PositionResiduals* like);

  int size() const { return 3 * static_cast<int>(factor_->nodes.size()); }
  double constant() const { return constant_; }
  int constantCount() const { return measured_count_ - size(); }

  Eigen::VectorXd residuals(const Eigen::Ref<const Points3>& nodes) const;
  /// From d(positions)/d(anything), 3 nodes x columns.
  Eigen::MatrixXd derivative(const Eigen::MatrixXd& positions_by) const;

  /// Errors that move all nodes together, such as those of clip poses: adds the covariance E E^T to
  /// the residuals', whose own is the identity, and whitens by its inverse square root. `modes`: 3
  /// nodes x errors, scaled by their standard deviations.
  void setCommonErrors(const Eigen::MatrixXd& modes);

 private:
  struct Factor {
    Eigen::VectorXd weights;  ///< Per vertex.
    std::vector<int> nodes;   ///< Those that some vertex sees, in the factor's order.
    Eigen::SparseMatrix<double> lower;
  };
  static std::shared_ptr<const Factor> factorize(const Interpolation& p, Eigen::VectorXd weights);
  Eigen::MatrixXd reduced(const Eigen::Ref<const Points3>& nodes) const;
  void whiten(Eigen::MatrixXd& rows) const;

  std::shared_ptr<const Factor> factor_;
  Points3 best_;  ///< 3 x factor nodes.
  double constant_ = 0.0;
  int measured_count_ = 0;
  Eigen::MatrixXd mode_basis_;    ///< Orthonormal columns.
  Eigen::VectorXd mode_removed_;  ///< 1 - 1 / sqrt(1 + s^2).
};

/// What the displacement's Laplacian weighs beside the vertices: a start for a solver is better
/// smooth, a shape for its own sake is not to be moved.
inline constexpr double kSmoothStart = 0.05, kFillOnly = 1e-6;

/// A smooth configuration near the measured one: least squares at the vertices with a little of the
/// displacement's Laplacian, which fills what no vertex shows. Held nodes keep their place in
/// `nodes`; the others are overwritten.
void fillMeasuredShape(const Interpolation& interpolation, const TrackedFrame& frame,
                       const GridLines& lines, const Points3& rest, const std::vector<bool>& held,
                       Points3& nodes, double smoothing = kSmoothStart);

/// Squared errors of the vertices that are seen, and what noise alone makes of them.
struct PositionMisfit {
  double squares_m2 = 0.0, noise_m2 = 0.0;
  Eigen::Index coordinates = 0;
};
void addPositionMisfit(const Interpolation& interpolation, const TrackedFrame& frame,
                       const Eigen::Ref<const Points3>& nodes, PositionMisfit& sums);

/// Root mean square of the vertices' vector errors [m]; NaN when none is seen.
double positionRms(const Interpolation& interpolation, const TrackedFrame& frame,
                   const Eigen::Ref<const Points3>& nodes);

}  // namespace tenter
