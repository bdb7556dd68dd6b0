// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>

#include "metric_elements.h"
#include "tenter/inversion/contacts.h"
#include "tenter/inversion/softness_proof.h"
#include "tenter/mechanics/sparse_cholesky.h"

namespace tenter {

/// Of Newton's steps: the least, the share of the way to the border, by how much they are
/// shortened, the share of the predicted decrease that is enough; the decrement below which a point
/// is central enough for more of what is wanted, and how much more.
inline constexpr double kLeastBarrierStep = 1e-9, kToBorder = 0.9, kShorterStep = 0.7,
                        kSufficientDecrease = 1e-4;
inline constexpr double kCentralDecrement = 1.0, kBarrierGrowth = 5.0;

/// Steps by which a proof is improved once there is one.
inline constexpr int kImprovements = 8;

/// Interior-point method over metric rest states: elements' z within their bounds and contact
/// forces f inside their cones, balanced: sum of z g + dE_weight/dx = f at contacts, 0 elsewhere,
/// any value at fixed vertices. Every step factorises one matrix with the elastic Hessian's
/// pattern, sum of g g^T / (barrier's second derivative).
class MetricBarrier {
 public:
  struct Limits {
    std::function<bool()> stop;
    int max_steps = 80;
  };
  enum class Outcome { kReached, kInfeasible, kStalled };

  MetricBarrier(const InverseShell& shell, const MetricElements& elements, std::vector<int> fixed,
                std::vector<Contact> contacts);

  /// From the target's own rest state to one that balances, far from all bounds: minimises the
  /// share of the load that is left, then the barrier. kInfeasible: no state within bounds
  /// balances, see proof().
  Outcome balance(const Limits& limits);

  /// From what balance() found: maximises lambda in columns^T (H(z) - lambda M) columns >= 0 until
  /// it reaches `wanted`. kInfeasible: not even the bound of what can be reached is positive.
  /// @param columns  3 a vertex, zero at fixed vertices and contacts; made M-orthonormal.
  Outcome stabilize(Eigen::MatrixXd& columns, double wanted_per_s2, const Limits& limits);

  /// Those directions in the columns of the last stabilize() along which H(z) is least.
  Eigen::MatrixXd softest(const Eigen::MatrixXd& columns, int count) const;

  const Eigen::VectorXd& z() const { return z_; }
  /// Takes another balanced state, and mends what rounding left of it.
  void set(const Eigen::VectorXd& z);
  bool inside(const Eigen::VectorXd& z) const;            ///< Bounds, and cones by the forces of z.
  double lambda_per_s2() const { return lambda_; }        ///< Reached by stabilize().
  double boundOnLambda_per_s2() const { return bound_; }  ///< What no state exceeds there.
  const std::optional<SoftnessProof>& proof() const { return proof_; }
  int factorizations() const { return factorizations_; }

 private:
  /// A Newton step of the barrier problem, and the multipliers of the rows.
  struct Step {
    Eigen::VectorXd z, f, nu;
  };

  class Stability;

  int rowOf(int vertex) const { return first_row_[vertex]; }
  Eigen::VectorXd rows(const Eigen::VectorXd& coordinates) const;
  Eigen::VectorXd coordinates(const Eigen::VectorXd& rows) const;
  Eigen::VectorXd residual(const Eigen::VectorXd& z, const Eigen::VectorXd& f) const;
  bool factorize();
  void weigh(const Eigen::VectorXd& z, const Eigen::VectorXd& f);
  Step newton(const Eigen::VectorXd& gz, const Eigen::VectorXd& gf,
              const Eigen::VectorXd& residual);
  Eigen::MatrixXd reduced(const Eigen::MatrixXd& columns);
  double barrier(const Eigen::VectorXd& z, const Eigen::VectorXd& f) const;
  double coneValue(const Vec3& f, std::size_t contact) const;
  double longest(const Step& step) const;
  double acceptable(const Step& step, double slope, double decrement) const;
  static double dualRoom(const Contact& contact, const Vec3& motion);
  bool coneHolds(const Eigen::VectorXd& nu) const;
  double slackOf(const Eigen::VectorXd& c) const;
  Eigen::VectorXd forcesOf(const Eigen::VectorXd& z) const;
  void mend();
  Outcome centre(const Limits& limits);
  void keepProof(Points3 motion, std::vector<Points3> modes);
  /// Whether proofs have been improved upon for long enough.
  bool provedEnough() { return proof_ && ++improvements_ > kImprovements; }

  const InverseShell& shell_;
  const MetricElements& elements_;
  std::vector<int> fixed_;
  std::vector<Contact> contacts_;
  std::vector<int> first_row_;  ///< Of each vertex; -1 if fixed.
  int row_count_ = 0;
  double unit_N_ = 0.0;     ///< Mean weight of a vertex: the unit of rows and of f.
  Eigen::VectorXd weight_;  ///< dE_weight/dx in rows.
  Eigen::VectorXd mass_;    ///< Of each coordinate.
  SparseLower normal_;
  SparseCholesky cholesky_;
  std::vector<int> slots_;  ///< Where each element's lower products go; -1: nowhere.
  std::vector<std::array<int, 6>> contact_slots_;
  Eigen::VectorXd z_, f_, central_z_, central_f_, lower_, upper_;
  Eigen::VectorXd slope_z_, slope_f_, inverse_z_;  ///< Of the barrier: gradient, 1 / curvature.
  std::vector<Mat3> inverse_f_;
  double lambda_ = 0.0, bound_ = 0.0;
  std::optional<SoftnessProof> proof_;  ///< The one that holds for the largest weight change.
  int improvements_ = 0;
  int factorizations_ = 0;
};

}  // namespace tenter
