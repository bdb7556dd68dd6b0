// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "contact_load.h"
#include "force_balance.h"

namespace tenter {

/// Contact forces that let a rest shape near the target come out with the least elastic energy: the
/// convex stage. The energy is that of the shell whose rest shape is the target.
class ContactForces {
 public:
  /// Error as ClothSystem::create.
  static Result<ContactForces> create(const InverseShell& shell, const Points3& pose,
                                      const BalanceSetup& setup);

  struct Solution {
    bool converged = false;
    Points3 forces;  ///< 3 x contacts [N], on the shell.
    Points3 motion;  ///< 3 x vertices: the dual's displacement.
    int factorizations = 0;
  };
  /// @param gradient  dE/dq of the whole shell at the target, for the rest shape at hand.
  Solution solve(const Eigen::VectorXd& gradient, const BalanceSetup& setup,
                 const std::function<bool()>& stop);

 private:
  explicit ContactForces(SparseLower h) : h_(std::move(h)), cholesky_(h_) {}
  void balanceRigidMotions(const Eigen::VectorXd& gradient, const BalanceSetup& setup,
                           Points3& forces) const;

  SparseLower h_;
  SparseCholesky cholesky_;
  Points3 pose_;
  std::vector<int> first_dof_;  ///< Of each vertex; -1 if fixed.
  double vertex_weight_N_ = 0.0;
  int fixed_count_ = 0;
};

}  // namespace tenter
