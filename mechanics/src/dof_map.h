// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/mechanics/cloth_system.h"

namespace tenter {

/// How the coordinates of a sheet follow from its degrees of freedom: free nodes and edge rotations
/// are degrees of freedom themselves, nodes of free clips move with six, all others are held.
struct DofMap {
  int node_count = 0;
  int rotation_count = 0;
  int dofs_per_node = 3;       ///< 2 in a planar system.
  std::vector<int> node_dof;   ///< First dof of a free node, or -1.
  std::vector<int> node_clip;  ///< Clip that holds the node, or -1.
  std::vector<int>
      node_held;  ///< First held coordinate (3 a node) of a node that does not move, or -1.
  std::vector<int> held_nodes;  ///< Nodes in the order of their held coordinates.
  std::vector<int> clip_dof;    ///< First of six dofs of a free clip, or -1.
  int rotation_dof = 0;         ///< First dof of the edge rotations.
  int dof_count = 0;

  int coordinateCount() const { return 3 * node_count + rotation_count; }
  int heldCount() const { return 3 * static_cast<int>(held_nodes.size()); }
  bool onFreeClip(int node) const { return node_clip[node] >= 0 && clip_dof[node_clip[node]] >= 0; }

  /// Error when a node has two supports, an id is out of range, or nothing is left to move.
  static Result<DofMap> create(int node_count, int rotation_count, const SystemSetup& setup);
};

/// Lever arms of the free clips at one state: dx = dt + dr / scale x arm.
struct ClipFrames {
  std::vector<Vec3> pivot;  ///< In the rig's frame [m].
  std::vector<double> rotation_scale_m;
};

/// d(node position)/d(clip dofs), 3 x 6.
Eigen::Matrix<double, 3, 6> clipJacobian(const Vec3& arm_m, double rotation_scale_m);

/// Second-order part of a finite rotation: gradient . d2x/dr2, for one point at `arm` with force
/// gradient `g` [N].
Mat3 rotationGeometricHessian(const Vec3& g, const Vec3& arm_m, double rotation_scale_m);

}  // namespace tenter
