// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "dof_map.h"
#include "hessian_assembler.h"
#include "tenter/mechanics/cloth_system.h"

namespace tenter {

/// Scratch memory is mutable: a system serves one thread.
struct ClothSystem::Impl {
  Impl(SheetMesh sheet_mesh, ClothTerms cloth_terms, SystemSetup system_setup, DofMap dof_map);

  void updateFrames(const ClothState& state) const;
  /// dE/dq of the sheet's terms into gradient_q.
  void coordinateGradient(const Eigen::VectorXd& q) const;
  /// gradient_q and the clips' own forces on the degrees of freedom.
  void reduceGradient(const ClothState& state, Eigen::VectorXd& dofs) const;
  /// Weight, point forces and cords of the free clips [J].
  double clipPotential(const ClothState& state) const;
  void addClipHessians(const ClothState& state, Projection projection) const;
  /// Calls visit(place, dE/dplace, d2E/dplace2) for the weight, forces and cords of a free clip.
  template <class Visitor>
  void forEachClipPoint(const ClothState& state, int clip, Visitor visit) const;
  /// Assembles the exact Hessian at `state` unless it already is.
  void ensureExact(const ClothSystem& system, const ClothState& state) const;
  /// d(position of held node)/d(pose: translation, rotation vector about the rig's origin).
  Eigen::Matrix<double, 3, 6> poseJacobian(const ClothState& state, int node) const;

  SheetMesh sheet;
  SystemSetup setup;
  DofMap map;
  std::vector<std::unique_ptr<EnergyTerm>> terms;
  std::vector<int> rotation_edge;
  Eigen::VectorXd nodal_mass;
  std::vector<int> parameter_offset;
  int parameter_count = 0;
  std::vector<Vec3> pivot_local;
  mutable ClipFrames frames;
  mutable Eigen::VectorXd gradient_q;
  mutable Eigen::VectorXd
      exact_at;  ///< Coordinates at which the assembled Hessian is exact; empty if it is not.
  std::unique_ptr<HessianAssembler> assembler;
};

}  // namespace tenter
