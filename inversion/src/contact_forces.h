// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "contact_load.h"
#include "rest_newton.h"

namespace tenter {

/// How far inside their friction cones forces are chosen.
struct ConeMargin {
  double friction_share = 0.975;  ///< Of mu.
  double offset = 0.02;           ///< Least normal force, in mean weights of a vertex.
  /// Half as far inside: room for what a change of weight moves.
  ConeMargin halved() const { return {0.5 * (1.0 + friction_share), 0.5 * offset}; }
};

/// The nearest forces inside the cones (3 x contacts), and whether they are there already.
Points3 projectedIntoCones(const RestNewton& problem, int vertex_count, const Points3& forces,
                           const ConeMargin& margin, double load = 1.0);
bool insideCones(const RestNewton& problem, int vertex_count, const Points3& forces,
                 const ConeMargin& margin, double load = 1.0);

/// Contact forces that let a rest shape near the target come out with the least elastic energy: the
/// convex stage. The energy is that of the shell whose rest shape is the target.
class ContactForces {
 public:
  /// Error as ClothSystem::create.
  static Result<ContactForces> create(const InverseShell& shell, const RestNewton& problem);

  struct Solution {
    bool converged = false;
    Points3 forces;  ///< 3 x contacts [N], on the shell.
    /// Displacement whose strains the rest shape of least energy has the other way round: 3 a
    /// vertex [m], then the rotations.
    Eigen::VectorXd motion;
    int factorizations = 0;
  };
  /// @param gradient  dE/dq of the whole shell at the target, for the rest shape at hand.
  Solution solve(const Eigen::VectorXd& gradient, const ConeMargin& margin, double load,
                 const std::function<bool()>& stop);

 private:
  explicit ContactForces(SparseLower h) : h_(std::move(h)), cholesky_(h_) {}

  SparseLower h_;
  SparseCholesky cholesky_;
  std::vector<Contact> contacts_;
  std::vector<int> first_dof_;  ///< Of each vertex; -1 if fixed.
  double vertex_weight_N_ = 0.0;
};

}  // namespace tenter
