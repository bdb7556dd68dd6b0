// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "sparse_lu.h"
#include "tenter/inversion/contacts.h"
#include "tenter/inversion/inverse_shell.h"
#include "tenter/mechanics/turning_path.h"

namespace tenter {

/// Unknowns of the inverse problem: rest positions, and the pose's edge rotations.
struct RestUnknowns {
  Points3 rest;
  Eigen::VectorXd rotations;
};

struct RestNewtonOptions {
  int max_iterations = 40;
  double tolerance = 2e-12;           ///< Of the total weight, 2-norm over all rows.
  double least_damping = 1.0 / 1024;  ///< Shorter shares of Newton's step are no progress.
  std::function<bool()> stop;
  std::function<void(int iteration, double residual, double damping)> progress;
};

struct RestNewtonResult {
  bool converged = false;
  int iterations = 0, factorizations = 0;
  double residual = 0.0;  ///< Of the total weight.
};

/// A derivative by what holds the shell.
struct HoldDerivative {
  Points3 by_forces;  ///< 3 x contacts.
  Points3 by_fixed;   ///< 3 x fixed vertices: by their rest positions.
};

/// The rest shape that balances *given* contact forces, with fixed vertices at given rest
/// positions: as many unknowns as rows, solved by Newton's method with sparse LU. Steps are judged
/// by the Newton correction that is left, not by the force: what is soft then counts as much as
/// what is stiff, and nothing squares the condition of the problem (docs/inversion.md).
///
/// Where the contacts alone stop rigid motions, forces may move by up to six numbers, in proportion
/// to their own length, because no rest shape can mend a global balance; as many coordinates of the
/// rest shape, its place, are kept.
class RestNewton {
 public:
  RestNewton(InverseShell& shell, Points3 pose, std::vector<int> fixed,
             std::vector<Contact> contacts);

  const Points3& pose() const { return pose_; }
  const std::vector<int>& fixed() const { return fixed_; }
  const std::vector<Contact>& contacts() const { return contacts_; }
  double weight_N() const { return weight_N_; }  ///< Of the target.

  /// dE/dq at the target with that share of gravity [N].
  Eigen::VectorXd gradient(const RestUnknowns& unknowns, double load) const;
  /// Its entries at the contacts: the obstacle's forces on the shell, 3 x contacts.
  Points3 contactForces(const Eigen::VectorXd& gradient) const;

  /// @param forces  3 x contacts [N]; returned as the global balance moved them.
  RestNewtonResult solve(RestUnknowns& unknowns, Points3& forces, double load,
                         const RestNewtonOptions& options);

  /// Unit rigid motions at the contacts that only contact forces stop, 3 x contacts each: forces do
  /// together on each what the weight does.
  std::vector<Points3> globalMotions() const;

  /// Total derivatives, along the balanced rest shapes, of functions whose derivatives by the
  /// unknowns (rest positions and rotations) are the columns of `by_unknowns`. Empty if the problem
  /// is singular there.
  std::vector<HoldDerivative> derivatives(const RestUnknowns& unknowns, const Points3& forces,
                                          const Eigen::MatrixXd& by_unknowns);

 private:
  Eigen::VectorXd residual(const RestUnknowns& u, const Points3& forces, double load) const;
  bool factorize(const RestUnknowns& u, double load);
  const InverseShell::Sparse& gradientByRest(const RestUnknowns& u, double load) const;
  void findGauge();
  void bind(const Points3& forces);
  void move(RestUnknowns& u, Points3& forces, const Eigen::VectorXd& step, double share) const;
  bool plausible(const Points3& rest) const;
  double lengthOf(const Eigen::VectorXd& step) const;

  InverseShell& shell_;
  Points3 pose_;
  std::vector<int> fixed_;
  std::vector<Contact> contacts_;
  Vec3 gravity_;
  Eigen::VectorXd target_area_;
  double weight_N_ = 0.0;
  TurningPath path_;
  double rounding_ = 0.0;                ///< Force that is zero but for rounding, of the weight.
  std::vector<int> row_of_, column_of_;  ///< Of each coordinate of the shell; -1: left out.
  std::vector<int> coordinate_of_;       ///< Of each column; -1: of the border.
  std::vector<int> border_column_;       ///< Columns of kept coordinates, which the border takes.
  Eigen::MatrixXd border_;               ///< Coordinates x border columns [N].
  Eigen::MatrixXd motions_;              ///< Rigid motions that nothing fixed stops, by coordinate.
  SparseLu lu_;
};

}  // namespace tenter
