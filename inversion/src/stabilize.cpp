// SPDX-License-Identifier: GPL-3.0-or-later
#include "stabilize.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "soft_modes.h"

namespace tenter {
namespace {

/// Of the target's size: the difference step along a mode, and the longest step of a round.
constexpr double kDifference = 1e-5, kLongestStep = 0.02;
constexpr double kOvershoot = 1.5;  ///< Cuts ask for this times the floor.
constexpr int kMaxHalvings = 4;
constexpr double kShrink = 0.3;
/// Room in a cone, of its radius, from which on a force is not watched.
constexpr double kNearBorder = 0.5;
/// So many rounds have to mend this share of what is missing.
constexpr int kTrial = 3;
constexpr double kWorthGoingOn = 0.05;

struct Modes {
  SoftModes modes;
  Eigen::MatrixXd full;  ///< Modes over all coordinates; zero where held.
};

class Stabilizer {
 public:
  Stabilizer(const InverseShell& shell, ForceBalance& balance, const StabilizeOptions& options)
      : shell_(shell), balance_(balance), options_(options), size_(sizeOf(balance.pose())) {
    held_ = balance.setup().fixed;
    for (const Contact& c : balance.setup().contacts) held_.push_back(c.vertex);
    std::vector<char> is_held(static_cast<std::size_t>(shell.vertexCount()), 0);
    for (const int v : held_) is_held[v] = 1;
    for (int v = 0; v < shell.vertexCount(); ++v)
      for (int a = 0; a < 3 && !is_held[v]; ++a) free_.push_back(3 * v + a);
    for (int r = 0; r < shell.rotationCount(); ++r) free_.push_back(3 * shell.vertexCount() + r);
  }

  Modes modesAt(const RestUnknowns& u, int count) {
    Modes out;
    auto system = shell_.system(u.rest, held_);
    if (!system) return out;
    ClothState state = system->restState();
    state.q = shell_.coordinates(balance_.pose(), u.rotations);
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
    const Eigen::VectorXd q = shell_.coordinates(balance_.pose(), u.rotations);
    Eigen::VectorXd out = shell_.gradientByRest(q + step * mode, u.rest).transpose() * mode;
    out -= shell_.gradientByRest(q - step * mode, u.rest).transpose() * mode;
    return out / (2.0 * step);
  }

  /// One round. False if no step raises the smallest eigenvalue.
  bool step(RestUnknowns& u, Modes& m) {
    std::vector<Eigen::VectorXd> cuts;
    std::vector<double> wanted;
    addModeCuts(u, m, cuts, wanted);
    addConeCuts(u, cuts, wanted);
    Eigen::MatrixXd c(shell_.coordinateCount(), static_cast<Eigen::Index>(cuts.size()));
    Eigen::VectorXd w(c.cols());
    for (std::size_t k = 0; k < cuts.size(); ++k) {
      const double norm = std::max(cuts[k].norm(), 1e-300);
      c.col(static_cast<Eigen::Index>(k)) = cuts[k] / norm;
      w[static_cast<Eigen::Index>(k)] = wanted[k] / norm;
    }
    const Eigen::VectorXd d = balance_.keepingForces(u, c, w);
    ++factorizations;
    const double longest = d.head(u.rest.size()).cwiseAbs().maxCoeff();
    if (!(longest > 0.0) || !std::isfinite(longest)) return false;
    for (int k = 0; k < kMaxHalvings; ++k) {
      if (options_.stop && options_.stop()) return false;
      const double t = std::min(1.0, reach_ / longest);
      RestUnknowns trial = u;
      ForceBalance::move(trial, d, t);
      const BalanceResult r = balance_.solve(trial, nullptr, options_.balance);
      factorizations += r.factorizations;
      if (r.converged) {
        Modes at_trial = modesAt(trial, options_.modes);
        if (at_trial.modes.values.size() > 0 &&
            deficit(at_trial.modes.values) < deficit(m.modes.values)) {
          u = std::move(trial);
          m = std::move(at_trial);
          if (k == 0) reach_ = std::min(2.0 * reach_, kLongestStep * size_);
          return true;
        }
      }
      reach_ = kShrink * std::min(reach_, longest);
    }
    return false;
  }

  int factorizations = 0;

 private:
  /// How far the eigenvalues are below the floor.
  double deficit(const Eigen::VectorXd& values) const {
    return (options_.lambda_floor_per_s2 - values.array()).cwiseMax(0.0).sum();
  }

  void addModeCuts(const RestUnknowns& u, const Modes& m, std::vector<Eigen::VectorXd>& cuts,
                   std::vector<double>& wanted) const {
    const double asked = kOvershoot * options_.lambda_floor_per_s2;
    for (Eigen::Index k = 0; k < m.modes.values.size() && m.modes.values[k] < asked; ++k) {
      cuts.push_back(curvatureByUnknowns(u, m.full.col(k)));
      wanted.push_back(asked - m.modes.values[k]);
    }
  }

  /// Contact forces stay inside their cones to first order.
  void addConeCuts(const RestUnknowns& u, std::vector<Eigen::VectorXd>& cuts,
                   std::vector<double>& wanted) const {
    const BalanceSetup& setup = balance_.setup();
    if (setup.contacts.empty()) return;
    const Points3 forces = balance_.contactForces(balance_.gradient(u));
    const auto& by_rest =
        shell_.gradientByRest(shell_.coordinates(balance_.pose(), u.rotations), u.rest);
    Eigen::VectorXd row = Eigen::VectorXd::Zero(shell_.coordinateCount());
    for (std::size_t i = 0; i < setup.contacts.size(); ++i) {
      const Contact& c = setup.contacts[i];
      const double mu = setup.friction_share * c.friction;
      const Vec3 force = forces.col(static_cast<Eigen::Index>(i));
      const double normal = force.dot(c.normal);
      const Vec3 tangent = force - normal * c.normal;
      const double room = mu * normal - tangent.norm();
      if (room > kNearBorder * mu * normal) continue;
      Vec3 inwards = mu * c.normal;
      if (tangent.norm() > 0.0) inwards -= tangent.normalized();
      row.segment<3>(3 * c.vertex) = inwards;
      cuts.push_back(by_rest.transpose() * row);
      wanted.push_back(-std::max(0.0, room));
      row.segment<3>(3 * c.vertex).setZero();
    }
  }

  const InverseShell& shell_;
  ForceBalance& balance_;
  const StabilizeOptions& options_;
  double size_;
  double reach_ = kLongestStep * size_;  ///< Longest step that is trusted.
  std::vector<int> held_, free_;
  std::optional<SparseCholesky> cholesky_;
};

}  // namespace

StabilizeResult stabilize(const InverseShell& shell, ForceBalance& balance, RestUnknowns& unknowns,
                          const StabilizeOptions& options) {
  StabilizeResult out;
  Stabilizer stabilizer(shell, balance, options);
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
    if (!stabilizer.step(unknowns, modes)) break;
  }
  out.factorizations = stabilizer.factorizations;
  return out;
}

}  // namespace tenter
