// SPDX-License-Identifier: GPL-3.0-or-later
#include "stabilize.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "free_coordinates.h"
#include "soft_modes.h"

namespace tenter {
namespace {

/// Of the target's size: the difference step along a mode, and what a fixed vertex' rest position
/// moves when a contact force moves by the mean of them all.
constexpr double kDifference = 1e-5, kFixedScale = 0.01;
constexpr double kOvershoot = 1.5;  ///< Cuts ask for this times the floor.
constexpr int kMaxTries = 5;
constexpr double kShrink = 0.3;
constexpr int kMaxSweeps = 300;
constexpr double kSweepChange = 1e-6;
/// So many rounds have to mend this share of what is missing.
constexpr int kTrial = 3;
constexpr double kWorthGoingOn = 0.05;

struct Modes {
  SoftModes modes;
  Eigen::MatrixXd full;  ///< Modes over all coordinates; zero where held.
};

class Stabilizer {
 public:
  Stabilizer(const InverseShell& shell, RestNewton& problem, const StabilizeOptions& options)
      : shell_(shell), problem_(problem), options_(options), size_(sizeOf(problem.pose())) {
    held_ = problem.fixed();
    for (const Contact& c : problem.contacts()) held_.push_back(c.vertex);
    free_ = freeCoordinates(shell.vertexCount(), held_);
    for (int r = 0; r < shell.rotationCount(); ++r) free_.push_back(3 * shell.vertexCount() + r);
  }

  Modes modesAt(const RestUnknowns& u, int count) {
    Modes out;
    auto system = shell_.system(u.rest, held_);
    if (!system) return out;
    ClothState state = system->restState();
    state.q = shell_.coordinates(problem_.pose(), u.rotations);
    const SparseLower& h = system->hessian(state, Projection::kNone);
    if (!cholesky_) cholesky_.emplace(h);
    out.modes = softModes(h, system->dofMass(), *cholesky_, count);
    factorizations += out.modes.factorizations;
    out.full = Eigen::MatrixXd::Zero(shell_.coordinateCount(), out.modes.vectors.cols());
    for (std::size_t k = 0; k < free_.size(); ++k)
      out.full.row(free_[k]) = out.modes.vectors.row(static_cast<Eigen::Index>(k));
    return out;
  }

  /// d(v' H v) / d(unknowns), by central differences of exact second derivatives along v.
  Eigen::VectorXd curvatureByUnknowns(const RestUnknowns& u, const Eigen::VectorXd& mode) const {
    const double step = kDifference * size_ / mode.cwiseAbs().maxCoeff();
    const Eigen::VectorXd q = shell_.coordinates(problem_.pose(), u.rotations);
    Eigen::VectorXd out = shell_.gradientByRest(q + step * mode, u.rest).transpose() * mode;
    out -= shell_.gradientByRest(q - step * mode, u.rest).transpose() * mode;
    return out / (2.0 * step);
  }

  /// One round. False if no step raises the smallest eigenvalue.
  bool step(RestUnknowns& u, Points3& forces, Modes& m) {
    std::vector<double> wanted;
    const std::vector<HoldDerivative> cuts = modeCuts(u, forces, m, wanted);
    if (cuts.empty()) return false;
    const HoldDerivative change = leastChange(forces, cuts, wanted);
    for (int k = 0; k < kMaxTries; ++k) {
      if (options_.stop && options_.stop()) return false;
      RestUnknowns trial = u;
      Points3 trial_forces = forces + share_ * change.by_forces;
      for (std::size_t i = 0; i < problem_.fixed().size(); ++i)
        trial.rest.col(problem_.fixed()[i]) +=
            share_ * change.by_fixed.col(static_cast<Eigen::Index>(i));
      const RestNewtonResult r = problem_.solve(trial, trial_forces, 1.0, options_.newton);
      factorizations += r.factorizations;
      if (r.converged && inside(trial_forces)) {
        Modes at_trial = modesAt(trial, options_.modes);
        if (at_trial.modes.values.size() > 0 &&
            deficit(at_trial.modes.values) < deficit(m.modes.values)) {
          u = std::move(trial);
          forces = std::move(trial_forces);
          m = std::move(at_trial);
          if (k == 0) share_ = std::min(1.0, 2.0 * share_);
          return true;
        }
      }
      share_ *= kShrink;
    }
    return false;
  }

  int factorizations = 0;

 private:
  /// Whether forces, moved by the global balance, are where they may be.
  bool inside(const Points3& forces) const {
    return insideCones(problem_, shell_.vertexCount(), forces, options_.margin.halved());
  }

  /// How far the eigenvalues are below the floor.
  double deficit(const Eigen::VectorXd& values) const {
    return (options_.lambda_floor_per_s2 - values.array()).cwiseMax(0.0).sum();
  }

  /// Derivatives of the eigenvalues that are too small, and by how much each has to rise.
  std::vector<HoldDerivative> modeCuts(const RestUnknowns& u, const Points3& forces, const Modes& m,
                                       std::vector<double>& wanted) {
    const double asked = kOvershoot * options_.lambda_floor_per_s2;
    Eigen::MatrixXd by_unknowns(shell_.coordinateCount(), m.modes.values.size());
    Eigen::Index count = 0;
    for (; count < m.modes.values.size() && m.modes.values[count] < asked; ++count) {
      by_unknowns.col(count) = curvatureByUnknowns(u, m.full.col(count));
      wanted.push_back(asked - m.modes.values[count]);
    }
    ++factorizations;
    return problem_.derivatives(u, forces, by_unknowns.leftCols(count));
  }

  /// A linear form of the change that has to reach `wanted`, or to be it.
  struct Row {
    HoldDerivative form;
    double wanted;
    bool equal;
    double multiplier = 0.0;
  };

  /// Least change, in forces of the mean size and kFixedScale, that meets the cuts, keeps the
  /// global balance and leaves forces in their cones: its dual, one multiplier a row, by coordinate
  /// ascent.
  HoldDerivative leastChange(const Points3& forces, const std::vector<HoldDerivative>& cuts,
                             const std::vector<double>& wanted) const {
    const double force_scale =
        forces.cols() > 0 ? forces.norm() / std::sqrt(static_cast<double>(forces.cols())) : 0.0;
    const double force_weight = force_scale * force_scale;
    const double fixed_weight = kFixedScale * size_ * kFixedScale * size_;
    const auto fixed_count = static_cast<Eigen::Index>(problem_.fixed().size());
    HoldDerivative pull{Points3::Zero(3, forces.cols()), Points3::Zero(3, fixed_count)};
    HoldDerivative change = pull;
    std::vector<Row> rows;
    for (std::size_t k = 0; k < cuts.size(); ++k) rows.push_back({cuts[k], wanted[k], false});
    for (const Points3& motion : problem_.globalMotions())
      rows.push_back({{motion, Points3::Zero(3, fixed_count)}, 0.0, true});
    for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
      double moved = 0.0;
      for (Row& row : rows) {
        const double curvature = force_weight * row.form.by_forces.squaredNorm() +
                                 fixed_weight * row.form.by_fixed.squaredNorm();
        if (!(curvature > 0.0)) continue;
        const double reached = row.form.by_forces.cwiseProduct(change.by_forces).sum() +
                               row.form.by_fixed.cwiseProduct(change.by_fixed).sum();
        double d = (row.wanted - reached) / curvature;
        if (!row.equal) d = std::max(d, -row.multiplier);
        row.multiplier += d;
        pull.by_forces += d * force_weight * row.form.by_forces;
        pull.by_fixed += d * fixed_weight * row.form.by_fixed;
        change.by_fixed = pull.by_fixed;
        change.by_forces = intoCones(forces + pull.by_forces, options_.margin) - forces;
        moved = std::max(moved, std::abs(d) * std::sqrt(curvature));
      }
      if (moved < kSweepChange) break;
    }
    return change;
  }

  Points3 intoCones(const Points3& forces, const ConeMargin& margin) const {
    return projectedIntoCones(problem_, shell_.vertexCount(), forces, margin);
  }

  const InverseShell& shell_;
  RestNewton& problem_;
  const StabilizeOptions& options_;
  double size_;
  double share_ = 1.0;  ///< Of the least change, that is trusted.
  std::vector<int> held_, free_;
  std::optional<SparseCholesky> cholesky_;
};

}  // namespace

StabilizeResult stabilize(const InverseShell& shell, RestNewton& problem, RestUnknowns& unknowns,
                          Points3& forces, const StabilizeOptions& options) {
  StabilizeResult out;
  Stabilizer stabilizer(shell, problem, options);
  Modes modes = stabilizer.modesAt(unknowns, options.modes);
  double earlier = -std::numeric_limits<double>::infinity();
  for (; modes.modes.values.size() > 0; ++out.rounds) {
    out.lambda_min_per_s2 = modes.modes.values[0];
    if (options.progress) options.progress(out.rounds, out.lambda_min_per_s2);
    out.stable = out.lambda_min_per_s2 >= options.lambda_floor_per_s2;
    if (out.stable || out.rounds >= options.max_rounds || (options.stop && options.stop())) break;
    if (out.rounds % kTrial == 0) {
      if (earlier + kWorthGoingOn * std::abs(earlier) > out.lambda_min_per_s2) break;
      earlier = out.lambda_min_per_s2;
    }
    if (!stabilizer.step(unknowns, forces, modes)) break;
  }
  out.factorizations = stabilizer.factorizations;
  return out;
}

}  // namespace tenter
