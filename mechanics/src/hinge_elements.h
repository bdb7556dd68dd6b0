// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "tenter/mechanics/energy_terms.h"

namespace tenter {

/// An edge with an angle: between two free triangles, or a free and a rigid one.
struct HingeEdge {
  std::array<int, 4> nodes;  ///< As dihedralAngle wants them.
  double rest_angle;
};

/// What one edge contributes to the curvature of one triangle: a = angle_share (theta - theta0) +
/// rotation_share q[rotation].
struct HingeSide {
  int edge = -1;                ///< Into the hinge edges; -1 on the boundary.
  int scalar = -1;              ///< Place of the rotation in the triangle's stencil; -1 without.
  int coordinate = 0;           ///< Place of the rotation in q.
  bool owner = false;           ///< Whether this triangle carries the edge's second derivative.
  double angle_share = 0.0;     ///< 0 on the boundary, 1 on a clamp line, 1/2 elsewhere.
  double rotation_share = 0.0;  ///< +-1 / edge length.
  Vec3 strain = Vec3::Zero();   ///< (l / A) (n_u^2, n_v^2, 2 n_u n_v) [1/m].
  std::array<int, 4> local{};   ///< Place in the triangle's stencil of the hinge edge's four nodes.
};

struct HingeTriangle {
  int triangle;
  double area;
  std::array<HingeSide, 3> sides;  ///< Opposite to corner 0, 1, 2.
};

struct HingeElements {
  std::vector<HingeEdge> edges;
  std::vector<HingeTriangle> triangles;
  std::vector<Stencil> stencils;   ///< One a triangle.
  std::vector<int> rotation_edge;  ///< Mesh edge of each rotation.
};

HingeElements buildHingeElements(const SheetMesh& sheet, const std::vector<bool>& rigid,
                                 EdgeRotations rotations, int first_coordinate);

}  // namespace tenter
