// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "tenter/inversion/inverse_shell.h"
#include "tenter/mechanics/dihedral_angle.h"

namespace tenter {

/// One element's rest value as an unknown z, 0 where the target is at rest: l / L0 - 1 of an edge,
/// theta - theta0 [rad] of a hinge. Gradient and Hessian of its energy are linear in z
/// (docs/inversion.md).
struct MetricElement {
  int edge = 0;  ///< Of the mesh.
  bool hinge = false;
  int node_count = 2;
  std::array<int, 4> nodes{};
  Vec12 force = Vec12::Zero();  ///< d(dE/dx) / dz [N]: rows of three a node.
  Mat12 block = Mat12::Zero();  ///< d(d2E/dx2) / dz [N/m].
  double stiffness = 0;         ///< Elastic energy is 1/2 stiffness z^2 [J].
  double value = 0.0;           ///< Length [m] or angle [rad] in the target.
  double lower = 0.0, upper = 0.0;
};

/// All elements of a shell of edges and raw hinges at its target: edges in the mesh's order, then
/// hinges.
class MetricElements {
 public:
  /// Error kUsage: a law whose elements have no rest value of their own, or whose stiffness is not
  /// constant.
  static Result<MetricElements> create(const InverseShell& shell);

  const std::vector<MetricElement>& all() const { return all_; }
  int count() const { return static_cast<int>(all_.size()); }

  Eigen::VectorXd forces(const Eigen::VectorXd& z) const;      ///< Sum of z g: 3 a vertex [N].
  Eigen::VectorXd works(const Eigen::VectorXd& motion) const;  ///< g . motion of each element.
  /// Sum over columns v of v . (d2E/dx2)/dz v, of each element.
  Eigen::VectorXd curvatures(const Eigen::MatrixXd& columns) const;
  /// Sum of z (d2E/dx2)/dz times columns of 3 a vertex.
  Eigen::MatrixXd stiffened(const Eigen::VectorXd& z, const Eigen::MatrixXd& columns) const;
  ElementRest restOf(const Eigen::VectorXd& z) const;

 private:
  std::vector<MetricElement> all_;
  int vertices_ = 0, edges_ = 0;
};

}  // namespace tenter
