// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "normal_factor.h"
#include "tenter/inversion/contacts.h"
#include "tenter/inversion/inverse_shell.h"

namespace tenter {

/// Unknowns of the inverse problem: rest positions, and the pose's edge rotations.
struct RestUnknowns {
  Points3 rest;
  Eigen::VectorXd rotations;
};

/// What the target asks of a rest shape: no force on free coordinates, contact forces inside
/// shrunken friction cones; anything on fixed vertices.
struct BalanceSetup {
  std::vector<int> fixed;
  std::vector<Contact> contacts;
  double friction_share = 0.975;  ///< Of mu, that the cones are solved for.
  double offset = 0.02;           ///< Least normal force, in mean weights of a vertex.
  double load = 1.0;              ///< Share of gravity.
};

struct BalanceOptions {
  int max_iterations = 100;
  double tolerance = 2e-12;  ///< Of the total weight, 2-norm over all rows.
  double first_damping = 1e-12;
  double last_damping = 1e-15;
  /// Gives up after `patience` iterations in a row that leave more than this share of the residual.
  double worthwhile = 1.0;
  int patience = 100;
  std::function<bool()> stop;
  std::function<void(int iteration, double residual)> progress;
};

struct BalanceResult {
  bool converged = false;
  int iterations = 0, factorizations = 0;
  double residual = 0.0;  ///< Of the total weight.
};

/// Levenberg and Marquardt's method on the forces at the target as a function of the rest shape,
/// turning into Newton's; least-norm steps where there are more unknowns than rows.
class ForceBalance {
 public:
  ForceBalance(InverseShell& shell, Points3 pose, BalanceSetup setup);

  BalanceSetup& setup() { return setup_; }
  const BalanceSetup& setup() const { return setup_; }
  const Points3& pose() const { return pose_; }

  /// With contact forces given (3 x contacts [N]) or, without, anywhere in their cones.
  BalanceResult solve(RestUnknowns& unknowns, const Points3* forces, const BalanceOptions& options);

  /// dE/dq at the target [N]; contact forces are its entries at the contacts.
  Eigen::VectorXd gradient(const RestUnknowns& unknowns) const;
  Points3 contactForces(const Eigen::VectorXd& gradient) const;

  /// Least-norm change of the unknowns that keeps the rows' values to first order and moves the
  /// linear forms `cuts` (columns, over rest positions and rotations) by at least `wanted`.
  Eigen::VectorXd keepingForces(const RestUnknowns& unknowns, const Eigen::MatrixXd& cuts,
                                const Eigen::VectorXd& wanted);

  /// u += scale * step.
  static void move(RestUnknowns& u, const Eigen::VectorXd& step, double scale);

 private:
  Eigen::VectorXd residual(const RestUnknowns& unknowns, const Points3* forces,
                           std::vector<Mat3>* selection) const;
  void jacobian(const RestUnknowns& unknowns, const std::vector<Mat3>& selection);
  bool plausible(const Points3& rest) const;

  InverseShell& shell_;
  Points3 pose_;
  BalanceSetup setup_;
  std::vector<char> fixed_;
  double scale_N_ = 1.0;  ///< Mean weight of a vertex.
  Vec3 gravity_;
  Eigen::VectorXd target_area_;
  Eigen::SparseMatrix<double> j_;
  std::optional<NormalFactor> factor_;
};

}  // namespace tenter
