// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/SparseCholesky>

#include "tenter/mechanics/equilibrium.h"
#include "tenter/twin/capture.h"

namespace tenter {

/// Finds the stable shapes that buckling sheets snap into. Newton's method first; where it labours
/// on the ridge between two shapes, descent along (H + shift I)^-1 g with the exact Hessian H, the
/// shift as small as keeps it positive definite, falls off the ridge; Newton's method ends it and
/// certifies the result.
class StableShapeSolver {
 public:
  explicit StableShapeSolver(const ClothSystem& system);

  /// True if `state` is now a converged, stable equilibrium; otherwise it is as it was.
  bool solve(ClothState& state, CaptureStatistics& statistics);

 private:
  /// From a saddle to lower energy along the softest direction.
  void leaveRidge(ClothState& state, double& energy);
  void descend(ClothState& state, CaptureStatistics& statistics);
  bool factorizeShifted(const ClothState& state, double& shift, CaptureStatistics& statistics);
  bool lineSearch(ClothState& state, double& energy);

  const ClothSystem& system_;
  EquilibriumSolver newton_;
  Eigen::SparseMatrix<double> shifted_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> cholesky_;
  Eigen::VectorXd gradient_, step_;
};

}  // namespace tenter
