// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "air_drag.h"
#include "tenter/inversion/shell_dynamics.h"
#include "tenter/mechanics/sparse_cholesky.h"

namespace tenter {

/// A vertex that may touch during a step. Its relative velocity is u = v - still: the normal part
/// is the gap at the end of the step over the step's length, the tangential part the slip.
struct StepContact {
  int vertex = 0, obstacle = 0;
  Vec3 normal = Vec3::UnitZ();  ///< Unit, from the obstacle to the shell.
  double friction = 0.0;
  Vec3 still = Vec3::Zero();  ///< [m/s]
};

/// One step of an implicit method: x = from + h v, and the force of contacts
///   r(v) = M (v - v_from) / h + dE/dx + alpha M v + D v - drag(v),
/// zero where nothing touches.
struct StepEquation {
  double h_s = 0.0;
  Eigen::VectorXd from, v_from;  ///< Over the degrees of freedom.
  std::vector<StepContact> contacts;
  double mass_damping_per_s = 0.0;
  const SparseLower* damping = nullptr;  ///< D [N s/m].
  const AirDrag* air = nullptr;
};

struct StepOutcome {
  bool converged = false;
  int iterations = 0, factorizations = 0;
  double residual_N = 0.0;
  std::vector<VertexContact> contacts;  ///< One a contact of the equation.
};

/// Solves a step with Coulomb's law in its exact form. With de Saxce's u~ = u + mu |u_T| n the law
/// says that r lies in the friction cone K, u~ in its dual, at right angles: r = P_K(r - rho u~)
/// for any rho > 0. As contacts act on single vertices r is what the equation of motion leaves
/// there, so this is a system in v alone; Newton's method on it, with symmetric matrices
/// (docs/resimulation.md).
class FrictionStep {
 public:
  /// @param first_dof  of each vertex, -1 if fixed; rotations follow the vertices.
  FrictionStep(const ClothSystem& system, std::vector<int> first_dof, double tolerance_N);

  /// @param v  the start of the iteration; the solution. @param state  follows it.
  StepOutcome solve(const StepEquation& equation, ClothState& state, Eigen::VectorXd& v,
                    const std::function<bool()>& stop);

  void place(const Eigen::VectorXd& dofs, ClothState& state) const;
  Eigen::VectorXd dofsOf(const ClothState& state) const;
  Points3 spread(const Eigen::VectorXd& dofs) const;  ///< To all vertices, zero where fixed.
  const std::vector<int>& firstDof() const { return first_dof_; }

 private:
  struct Point {
    Eigen::VectorXd forces;    ///< r.
    Eigen::VectorXd residual;  ///< r, at contacts r - P_K(r - rho u~).
    std::vector<Mat3> projections;
    double largest = 0.0, norm = 0.0;
  };
  /// What de Saxce's term adds to the derivative at a sliding vertex: column along^T.
  struct SlipColumn {
    int dof;
    Vec3 along, column;
  };
  void evaluate(const StepEquation& e, const Eigen::VectorXd& v, ClothState& state,
                Point& out) const;
  bool direction(const StepEquation& e, const Eigen::VectorXd& v, const ClothState& state,
                 const Point& at, Eigen::VectorXd& step, StepOutcome& out);
  void correctForSlip(const std::vector<SlipColumn>& slips, Eigen::VectorXd& step);
  bool assemble(const StepEquation& e, const Eigen::VectorXd& v, const ClothState& state,
                Projection projection, const std::vector<Mat3>& blocks);
  double stiffening(const StepEquation& e, const StepContact& contact) const;
  void addBlock(int dof, const Mat3& block);
  std::vector<VertexContact> contactsAt(const StepEquation& e, const Eigen::VectorXd& v,
                                        const Point& at) const;

  const ClothSystem& system_;
  std::vector<int> first_dof_;
  int position_dofs_ = 0;
  double tolerance_N_;
  Eigen::VectorXd mass_, stiffness_;  ///< Of each dof; the second is the start's diagonal [N/m].
  SparseLower matrix_;
  SparseCholesky cholesky_;
};

}  // namespace tenter
