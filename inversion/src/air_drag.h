// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/core/mesh.h"
#include "tenter/inversion/shell_dynamics.h"

namespace tenter {

/// Drag of moving air on the corners of triangles (docs/resimulation.md): on a corner with a third
/// of a triangle's area A and the velocity v, with w = wind - v split along the triangle's normal,
///   f = rho / 2  A / 3  (c_n |w_n| w_n + c_t |w_t| w_t).
class AirDrag {
 public:
  AirDrag(const AirSetup& air, const std::vector<Triangle>& triangles)
      : air_(air), triangles_(triangles) {}

  /// Takes normals and areas from these positions, for all calls that follow.
  void setShape(const Points3& positions);

  /// Adds the force [N] on each vertex at the velocities given, 3 x vertices, and, if not null, its
  /// resistance -df/dv [N s/m], positive semi-definite, one block a vertex.
  void add(const Points3& velocities, Points3& forces, std::vector<Mat3>* resistance) const;

 private:
  AirSetup air_;
  const std::vector<Triangle>& triangles_;
  Points3 normals_;
  Eigen::VectorXd areas_;
};

}  // namespace tenter
