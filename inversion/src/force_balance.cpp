// SPDX-License-Identifier: GPL-3.0-or-later
#include "force_balance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "second_order_cone.h"

namespace tenter {
namespace {

/// A rest triangle may shrink or grow this much against the target's.
constexpr double kLeastArea = 1e-3, kMostArea = 1e3;
constexpr double kEase = 0.1, kStiffen = 5.0;
constexpr int kMaxTries = 25;
/// The residual has to fall by this share of what the linear model foresees.
constexpr double kWorthwhile = 1e-4, kAsForeseen = 0.75, kPoor = 0.25;
/// Of the least damping: J J^T may be singular where contacts are free inside their cones.
constexpr double kKeepingDamping = 1e-13;

Eigen::VectorXd areasOf(const TriangleMesh& mesh, const Points3& x) {
  Eigen::VectorXd areas(static_cast<Eigen::Index>(mesh.triangles.size()));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& ids = mesh.triangles[t];
    const Vec3 a = x.col(ids[1]) - x.col(ids[0]), b = x.col(ids[2]) - x.col(ids[0]);
    areas[static_cast<Eigen::Index>(t)] = 0.5 * a.cross(b).norm();
  }
  return areas;
}

double largestRow(const Eigen::SparseMatrix<double>& j) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(j.rows());
  for (int c = 0; c < j.outerSize(); ++c)
    for (Eigen::SparseMatrix<double>::InnerIterator it(j, c); it; ++it)
      sum[it.row()] += it.value() * it.value();
  return sum.maxCoeff();
}

}  // namespace

ForceBalance::ForceBalance(InverseShell& shell, Points3 pose, BalanceSetup setup)
    : shell_(shell),
      pose_(std::move(pose)),
      setup_(std::move(setup)),
      fixed_(static_cast<std::size_t>(shell.vertexCount()), 0),
      gravity_(shell.material().gravity_m_per_s2),
      target_area_(areasOf(shell.target(), pose_)) {
  for (const int v : setup_.fixed) fixed_[v] = 1;
  scale_N_ = std::max(shell.weight_N(pose_) / shell.vertexCount(), 1e-300);
}

Eigen::VectorXd ForceBalance::gradient(const RestUnknowns& u) const {
  Eigen::VectorXd g;
  shell_.setGravity(setup_.load * gravity_);
  shell_.gradient(shell_.coordinates(pose_, u.rotations), u.rest, g);
  shell_.setGravity(gravity_);
  return g;
}

Points3 ForceBalance::contactForces(const Eigen::VectorXd& gradient) const {
  Points3 forces(3, static_cast<Eigen::Index>(setup_.contacts.size()));
  for (std::size_t i = 0; i < setup_.contacts.size(); ++i)
    forces.col(static_cast<Eigen::Index>(i)) = gradient.segment<3>(3 * setup_.contacts[i].vertex);
  return forces;
}

/// Rows in mean weights of a vertex. `selection`, one a contact: what is left of the force outside
/// its cone, derived by the force.
Eigen::VectorXd ForceBalance::residual(const RestUnknowns& u, const Points3* forces,
                                       std::vector<Mat3>* selection) const {
  Eigen::VectorXd r = gradient(u) / scale_N_;
  for (int v = 0; v < shell_.vertexCount(); ++v)
    if (fixed_[v]) r.segment<3>(3 * v).setZero();
  if (selection != nullptr) selection->assign(setup_.contacts.size(), Mat3::Identity());
  for (std::size_t i = 0; i < setup_.contacts.size(); ++i) {
    const Contact& c = setup_.contacts[i];
    auto row = r.segment<3>(3 * c.vertex);
    if (forces != nullptr) {
      row -= forces->col(static_cast<Eigen::Index>(i)) / scale_N_;
      continue;
    }
    const Vec3 force = row - setup_.load * setup_.offset * c.normal;
    const ConeProjection p =
        projectOnFrictionCone(force, c.normal, setup_.friction_share * c.friction);
    row = force - p.point;
    if (selection != nullptr) (*selection)[i] -= p.derivative;
  }
  return r;
}

void ForceBalance::jacobian(const RestUnknowns& u, const std::vector<Mat3>& selection) {
  shell_.setGravity(setup_.load * gravity_);
  j_ = shell_.gradientByRest(shell_.coordinates(pose_, u.rotations), u.rest);
  shell_.setGravity(gravity_);
  std::vector<int> contact_of(static_cast<std::size_t>(shell_.vertexCount()), -1);
  for (std::size_t i = 0; i < setup_.contacts.size(); ++i)
    contact_of[setup_.contacts[i].vertex] = static_cast<int>(i);
  const int positions = 3 * shell_.vertexCount();
  double* value = j_.valuePtr();
  const int* row = j_.innerIndexPtr();
  for (Eigen::Index k = 0; k < j_.nonZeros();) {
    if (row[k] >= positions) {
      value[k++] /= scale_N_;
      continue;
    }
    // The three rows of a vertex share one pattern, so their entries stand side by side.
    const int v = row[k] / 3;
    Eigen::Map<Vec3> rows(value + k);
    if (fixed_[v]) {
      rows.setZero();
    } else {
      rows /= scale_N_;
      if (contact_of[v] >= 0) rows = selection[contact_of[v]] * Vec3(rows);
    }
    k += 3;
  }
  if (!factor_) factor_.emplace(j_);
}

bool ForceBalance::plausible(const Points3& rest) const {
  const Eigen::ArrayXd share = areasOf(shell_.target(), rest).array() / target_area_.array();
  return rest.allFinite() && share.minCoeff() > kLeastArea && share.maxCoeff() < kMostArea;
}

void ForceBalance::move(RestUnknowns& u, const Eigen::VectorXd& step, double scale) {
  const Eigen::Index positions = u.rest.size();
  Eigen::Map<Eigen::VectorXd>(u.rest.data(), positions) += scale * step.head(positions);
  u.rotations += scale * step.tail(u.rotations.size());
}

BalanceResult ForceBalance::solve(RestUnknowns& u, const Points3* forces,
                                  const BalanceOptions& options) {
  BalanceResult out;
  std::vector<Mat3> selection;
  Eigen::VectorXd r = residual(u, forces, &selection);
  const double to_weight = 1.0 / shell_.vertexCount();
  double square = r.squaredNorm(), damping = options.first_damping;
  double last = std::numeric_limits<double>::infinity();
  int slow = 0;
  for (;; ++out.iterations) {
    out.residual = std::sqrt(square) * to_weight;
    if (options.progress) options.progress(out.iterations, out.residual);
    out.converged = out.residual <= options.tolerance;
    if (out.residual > options.worthwhile * last)
      ++slow;
    else
      slow = 0;
    last = out.residual;
    if (slow >= options.patience && !out.converged) return out;
    if (out.converged || out.iterations >= options.max_iterations ||
        (options.stop && options.stop()))
      return out;
    jacobian(u, selection);
    const double stiffest = std::max(largestRow(j_), 1e-300);
    bool moved = false;
    for (int k = 0; k < kMaxTries && !moved; ++k) {
      if (options.stop && options.stop()) return out;
      ++out.factorizations;
      if (!factor_->factorize(j_, damping * stiffest)) {
        damping = std::max(10.0 * damping, 1e-16);
        continue;
      }
      const Eigen::VectorXd step = -(j_.transpose() * Eigen::VectorXd(factor_->solve(r)));
      RestUnknowns trial = u;
      move(trial, step, 1.0);
      std::vector<Mat3> trial_selection;
      Eigen::VectorXd trial_r;
      double trial_square = std::numeric_limits<double>::infinity();
      if (plausible(trial.rest)) {
        trial_r = residual(trial, forces, &trial_selection);
        trial_square = trial_r.squaredNorm();
      }
      const double foreseen = square - (r + j_ * step).squaredNorm();
      const double gained = square - trial_square;
      if (std::isfinite(trial_square) && foreseen > 0.0 && gained > kWorthwhile * foreseen) {
        if (gained > kAsForeseen * foreseen)
          damping = std::max(kEase * damping, options.last_damping);
        if (gained < kPoor * foreseen) damping *= 3.0;
        u = std::move(trial);
        r = std::move(trial_r);
        selection = std::move(trial_selection);
        square = trial_square;
        moved = true;
      } else {
        damping *= kStiffen;
      }
    }
    if (!moved) return out;
  }
}

Eigen::VectorXd ForceBalance::keepingForces(const RestUnknowns& u, const Eigen::MatrixXd& cuts,
                                            const Eigen::VectorXd& wanted) {
  std::vector<Mat3> selection;
  residual(u, nullptr, &selection);
  jacobian(u, selection);
  factor_->factorize(j_, kKeepingDamping * std::max(largestRow(j_), 1e-300));
  const Eigen::MatrixXd images = j_ * cuts;
  const Eigen::MatrixXd kept = cuts - j_.transpose() * factor_->solve(images);
  // Least-norm sum of the kept parts that meets every cut: non-negative least squares by
  // coordinate descent on the small Gram matrix.
  const Eigen::MatrixXd gram = kept.transpose() * kept;
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(cuts.cols());
  for (int sweep = 0; sweep < 2000; ++sweep) {
    double change = 0.0;
    for (Eigen::Index i = 0; i < weight.size(); ++i) {
      if (!(gram(i, i) > 0.0)) continue;
      const double before = weight[i];
      weight[i] = std::max(0.0, before - (gram.row(i).dot(weight) - wanted[i]) / gram(i, i));
      change = std::max(change, std::abs(weight[i] - before) * std::sqrt(gram(i, i)));
    }
    if (change < 1e-12) break;
  }
  return kept * weight;
}

}  // namespace tenter
