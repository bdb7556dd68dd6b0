// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace tenter {

using Vec12 = Eigen::Matrix<double, 12, 1>;
using Mat12 = Eigen::Matrix<double, 12, 12>;

/// Signed dihedral angle theta in (-pi, pi] of one interior edge, 0 when flat. Vertices as rows of
/// twelve: edge (0, 1), then vertex 2 of the triangle that runs along the edge from 0 to 1, vertex
/// 3 of the other. Positive when the sheet is convex seen from the side that the normal (x1 - x0) x
/// (x2 - x0) points to.
/// @param gradient, hessian  d theta / dx, d^2 theta / dx^2, written if not null. Never allocates;
/// a degenerate triangle gives zero.
double dihedralAngle(const Vec12& x, Vec12* gradient = nullptr, Mat12* hessian = nullptr);

}  // namespace tenter
