// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "tenter/mechanics/sparse_cholesky.h"

namespace tenter {

/// One cone of a ContactLoad problem.
struct LoadCone {
  int first_dof = 0;  ///< Of its vertex.
  Vec3 normal = Vec3::UnitZ();
  double friction = 0.0;
};

struct ContactLoadResult {
  bool converged = false;
  Points3 forces;          ///< 3 x cones [N], on the shell.
  Eigen::VectorXd motion;  ///< The displacement of the dual problem [m]; grows along a motion that
                           ///< no contact can stop where there is no solution.
  int factorizations = 0;
};

/// Which contact forces carry a load with the least elastic energy: with S the contacts' dofs,
///   min over f_i in the friction cones of 1/2 (load + S f)^T H^-1 (load + S f),
/// solved as its dual, min 1/2 u^T H u - load^T u with u_i in the cones' duals, by a primal-dual
/// interior-point method whose every step factorises H plus a 3 x 3 block a contact
/// (docs/inversion.md). H may be singular along motions that the contacts stop.
ContactLoadResult solveContactLoad(const SparseLower& h, const Eigen::VectorXd& load,
                                   const std::vector<LoadCone>& cones, SparseCholesky& cholesky,
                                   const std::function<bool()>& stop);

}  // namespace tenter
