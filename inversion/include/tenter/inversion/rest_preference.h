// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/inversion/inverse_shell.h"

namespace tenter {

/// What a rest shape is to be like as far as the forces at contacts leave a choice ([Inv18]
/// sec. 9.3; docs/inversion.md).
enum class RestShapeKind {
  kNearTarget,  ///< The least elastic energy between rest shape and target.
  kFlat,        ///< The same to a shell without rest angles.
  kSmooth,      ///< The same to a shell with the rest angles of the faired target.
};

struct RestPreference {
  RestShapeKind kind = RestShapeKind::kNearTarget;
  double share = 1.0;  ///< Of the way from the target's angles to the wanted ones, 0 ... 1.
  /// Of kSmooth: waves shorter than 2 pi times this are faired; 0: kSmoothing of the target's size.
  double smoothing_length_m = 0.0;
};

/// Of the target's size (its box's diagonal).
inline constexpr double kSmoothing = 0.03;

/// The surface of least sum of M |x - x0|^2 + length^4 |mean curvature|^2: folds shorter than 2 pi
/// `length` go, flat and gently curved parts stay. The mesh as it is, where its triangles are too
/// thin for that.
Points3 faired(const TriangleMesh& mesh, double length_m);

/// Rest angles that are wished for, one a mesh edge [rad]; 0 on the border.
Eigen::VectorXd wantedAngles(const InverseShell& shell, const RestPreference& preference);

/// dE/dq [N] of bending, at the target, of a shell with these rest angles and the target's lengths:
/// the moments that hold it in the target's shape.
Eigen::VectorXd bendingGradient(const InverseShell& shell, const Eigen::VectorXd& rest_angle_rad);

/// How far a shape, or lengths and angles, are from one that can be cut from flat cloth.
struct ShapeMeasures {
  double bend_rms_rad = 0.0;    ///< Of dihedral angles.
  double fold_rms_rad = 0.0;    ///< Of dihedral angles less those of the faired target.
  double defect_rms_rad = 0.0;  ///< Of 2 pi minus the sum of angles at inner vertices.
};
/// @param faired_angle_rad  of the faired target, one a mesh edge.
ShapeMeasures measureShape(const InverseShell& shell, const ElementRest& rest,
                           const Eigen::VectorXd& faired_angle_rad);

/// Of the target, length 0: kSmoothing of its size.
Eigen::VectorXd fairedAngles(const InverseShell& shell, double smoothing_length_m);

/// Lengths and angles of a mesh's edges.
ElementRest elementsOf(const MeshTopology& topology, const Points3& positions);

}  // namespace tenter
