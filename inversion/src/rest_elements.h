// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <ceres/jet.h>

#include <array>

#include "tenter/mechanics/dihedral_angle.h"
#include "tenter/mechanics/energy_terms.h"

namespace tenter {

// Gradients of single elements by the pose, and the derivative of these by the rest positions. The
// pose is fixed, so only what belongs to the rest shape carries derivatives.

/// k_L (L - L0)^2 / (2 L0) of an edge, and its like with any law: L0 W(L / L0 - 1).
struct EdgeGradient {
  Vec3 force;  ///< On end 1; minus this on end 0.
  Mat3 block;  ///< d force / d rest position of end 1; minus this of end 0.
};
EdgeGradient edgeGradient(const StrainLaw& law, int element, const std::array<Vec3, 2>& x,
                          const std::array<Vec3, 2>& rest);

/// (3 L0^2 / A) W(theta - theta0) of an inner edge.
struct RawHingeGradient {
  Vec12 force;
  Mat12 block;
};
RawHingeGradient rawHingeGradient(const StrainLaw& law, int element, const Vec12& x,
                                  const Vec12& rest);

/// Weight of a triangle, minus a third of it at each corner.
struct WeightGradient {
  Vec3 force;                  ///< On each corner.
  std::array<Mat3, 3> blocks;  ///< d force / d rest position of each corner.
};
WeightGradient weightGradient(double areal_density, const Vec3& gravity,
                              const std::array<Vec3, 3>& rest);

/// Membrane triangle, measured as [Est12] eq. 3 or 4.
struct MembraneGradient {
  Eigen::Matrix<double, 9, 1> force;
  Eigen::Matrix<double, 9, 9> block;
};
MembraneGradient membraneGradient(const StrainLaw& law, int element, MembraneElement measure,
                                  const Mat2& frame, const std::array<Vec3, 3>& x,
                                  const std::array<Vec3, 3>& rest);

/// One side of a bent triangle.
struct BentSide {
  bool hinge = false;                ///< Inner edge.
  bool first = true;                 ///< Whether the triangle is the edge's triangle 0.
  std::array<int, 4> hinge_nodes{};  ///< Local ids, as dihedralAngle wants them.
  int begin = 0, end = 0;            ///< Local ids of the edge's ends.
  double rotation = 0.0;             ///< q of the edge's rotation [m].
};

/// Bent triangle of the hinge term with a rotation on every edge (energy_terms.h).
inline constexpr int kBentSize = 21;
struct BentTriangle {
  int node_count = 3;  ///< Up to 6; corners first.
  std::array<Vec3, 6> x, rest;
  std::array<BentSide, 3> sides;  ///< Opposite to corner 0, 1, 2.
  Mat2 frame;
};
struct BentGradient {
  Eigen::Matrix<double, kBentSize, 1> force;  ///< Six nodes, then three rotations.
  Eigen::Matrix<double, kBentSize, kBentSize> block;
};
BentGradient bentGradient(const StrainLaw& law, int element, const BentTriangle& triangle);

}  // namespace tenter
