// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference_method.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "tenter/mechanics/equilibrium.h"

namespace tenter {
namespace {

// [Inv18] sec. 7.1.
constexpr double kFirstLambda = 1000.0, kLastLambda = 0.1;  // [N/m]
constexpr double kTolerance = 1e-15;
constexpr int kDrapeIterations = 2000, kConeIterations = 5000;
/// Of a vertex's mean weight: force that a drape leaves.
constexpr double kDrapeForce = 1e-9;

/// lambda / 2 |x - target|^2 over all vertices [Inv18] eq. 24.
class TargetTerm final : public EnergyTerm {
 public:
  TargetTerm(const Points3& target, double lambda) : target_(target), lambda_(lambda) {
    for (int v = 0; v < static_cast<int>(target.cols()); ++v) {
      Stencil s;
      s.nodes[0] = v;
      s.node_count = 1;
      stencils_.push_back(s);
    }
  }
  const std::vector<Stencil>& stencils() const override { return stencils_; }
  double energy(const Eigen::VectorXd& q) const override {
    return 0.5 * lambda_ * (q.head(target_.size()) - flat()).squaredNorm();
  }
  void addGradient(const Eigen::VectorXd& q, Eigen::VectorXd& gradient) const override {
    gradient.head(target_.size()) += lambda_ * (q.head(target_.size()) - flat());
  }
  void addHessian(const Eigen::VectorXd& /*q*/, Projection /*projection*/,
                  HessianSink& sink) const override {
    const Mat3 block = lambda_ * Mat3::Identity();
    for (int v = 0; v < static_cast<int>(stencils_.size()); ++v) sink.add(v, block.data());
  }

 private:
  Eigen::Map<const Eigen::VectorXd> flat() const { return {target_.data(), target_.size()}; }
  Points3 target_;
  double lambda_;
  std::vector<Stencil> stencils_;
};

/// What both steps share: the rest positions of some vertices as variables.
class Problem {
 public:
  Problem(const InverseShell& shell, const RestNewton& problem, const ReferenceOptions& options)
      : shell_(shell), problem_(problem), options_(options) {
    held_ = problem.fixed();
    for (const Contact& c : problem.contacts()) held_.push_back(c.vertex);
    const auto n = static_cast<std::size_t>(shell.vertexCount());
    std::vector<char> held(n, 0), fixed(n, 0);
    for (const int v : held_) held[static_cast<std::size_t>(v)] = 1;
    for (const int v : problem.fixed()) fixed[static_cast<std::size_t>(v)] = 1;
    for (int v = 0; v < shell.vertexCount(); ++v) {
      if (held[static_cast<std::size_t>(v)] == 0) free_.push_back(v);
      if (fixed[static_cast<std::size_t>(v)] == 0) movable_.push_back(v);
    }
  }

  const InverseShell& shell() const { return shell_; }
  const RestNewton& problem() const { return problem_; }
  const std::vector<int>& held() const { return held_; }
  const std::vector<int>& free() const { return free_; }        ///< Neither fixed nor a contact.
  const std::vector<int>& movable() const { return movable_; }  ///< Not fixed.
  bool stopped() const { return options_.stop && options_.stop(); }

 private:
  const InverseShell& shell_;
  const RestNewton& problem_;
  const ReferenceOptions& options_;
  std::vector<int> held_, free_, movable_;
};

Eigen::VectorXd gathered(const Eigen::VectorXd& coordinates, const std::vector<int>& vertices) {
  Eigen::VectorXd out(3 * static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i)
    out.segment<3>(3 * static_cast<Eigen::Index>(i)) = coordinates.segment<3>(3 * vertices[i]);
  return out;
}

void scatter(const double* values, const std::vector<int>& vertices, Points3& rest) {
  for (std::size_t i = 0; i < vertices.size(); ++i)
    rest.col(vertices[i]) = Eigen::Map<const Vec3>(values + 3 * i);
}

/// Step 1: 1/2 |drape - target|^2 by the rest positions of free vertices.
class DrapeCost final : public ceres::FirstOrderFunction {
 public:
  DrapeCost(const Problem& p, double lambda, Points3 rest, ReferenceResult& count)
      : p_(p), lambda_(lambda), rest_(std::move(rest)), count_(count) {}

  int NumParameters() const override { return 3 * static_cast<int>(p_.free().size()); }

  bool Evaluate(const double* variables, double* cost, double* gradient) const override {
    if (p_.stopped()) return false;
    Points3 rest = rest_;
    scatter(variables, p_.free(), rest);
    Eigen::VectorXd q;
    std::unique_ptr<ClothSystem> system;
    if (!drape(rest, q, system)) return false;
    const Points3& target = p_.problem().pose();
    const Eigen::VectorXd off =
        q.head(target.size()) - Eigen::Map<const Eigen::VectorXd>(target.data(), target.size());
    *cost = 0.5 * off.squaredNorm();
    if (gradient == nullptr) return true;
    EquilibriumSolver solver(*system);
    ClothState state = system->restState();
    state.q = q;
    if (!solver.factorize(state)) return false;
    // Free vertices come first among the degrees of freedom, in order, then rotations.
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(system->dofCount());
    const Eigen::VectorXd free_off = gathered(off, p_.free());
    rhs.head(free_off.size()) = free_off;
    const Eigen::MatrixXd adjoint = solver.solveLinear(rhs);
    Eigen::VectorXd all = Eigen::VectorXd::Zero(p_.shell().coordinateCount());
    for (std::size_t i = 0; i < p_.free().size(); ++i)
      all.segment<3>(3 * p_.free()[i]) =
          adjoint.col(0).segment<3>(3 * static_cast<Eigen::Index>(i));
    all.tail(p_.shell().rotationCount()) = adjoint.col(0).tail(p_.shell().rotationCount());
    const Eigen::VectorXd by_rest = -(p_.shell().gradientByRest(q, rest).transpose() * all);
    Eigen::Map<Eigen::VectorXd>(gradient, NumParameters()) = gathered(by_rest, p_.free());
    return true;
  }

  /// Minimum of the energy near the target, and the system it is of.
  bool drape(const Points3& rest, Eigen::VectorXd& q, std::unique_ptr<ClothSystem>& system) const {
    ++count_.drapes;
    if (!rest.allFinite()) return false;
    std::vector<std::unique_ptr<EnergyTerm>> towards;
    if (lambda_ > 0.0)
      towards.push_back(std::make_unique<TargetTerm>(p_.problem().pose(), lambda_));
    auto made = p_.shell().system(rest, p_.held(), std::move(towards));
    if (!made) return false;
    system = std::make_unique<ClothSystem>(std::move(made).value());
    ClothState state = system->restState();
    state.q = p_.shell().coordinates(p_.problem().pose(),
                                     Eigen::VectorXd::Zero(p_.shell().rotationCount()));
    EquilibriumOptions options;
    options.force_tolerance_N = kDrapeForce * p_.problem().weight_N() / p_.shell().vertexCount();
    options.cancelled = [this] { return p_.stopped(); };
    EquilibriumSolver solver(*system);
    if (!solver.solve(state, options).converged()) return false;
    q = state.q;
    return true;
  }

 private:
  const Problem& p_;
  double lambda_;
  Points3 rest_;
  ReferenceResult& count_;
};

/// Step 2: 1/2 |G_K(F)|^2 at the pose of step 1, by the rest positions of all but fixed vertices.
class ConeCost final : public ceres::FirstOrderFunction {
 public:
  ConeCost(const Problem& p, double lambda, double friction_share, Points3 rest, Eigen::VectorXd q)
      : p_(p),
        lambda_(lambda),
        friction_share_(friction_share),
        rest_(std::move(rest)),
        q_(std::move(q)) {}

  int NumParameters() const override { return 3 * static_cast<int>(p_.movable().size()); }

  bool Evaluate(const double* variables, double* cost, double* gradient) const override {
    if (p_.stopped()) return false;
    Points3 rest = rest_;
    scatter(variables, p_.movable(), rest);
    Eigen::VectorXd force;
    p_.shell().gradient(q_, rest, force);
    const Points3& target = p_.problem().pose();
    force.head(target.size()) +=
        lambda_ *
        (q_.head(target.size()) - Eigen::Map<const Eigen::VectorXd>(target.data(), target.size()));
    for (const int v : p_.problem().fixed()) force.segment<3>(3 * v).setZero();
    double squares = 0.0;
    Eigen::VectorXd pull = force;  // half the squares derived by the force
    for (const Contact& c : p_.problem().contacts()) {
      const Outside out = outside(force.segment<3>(3 * c.vertex), c);
      squares += out.height * out.height;
      pull.segment<3>(3 * c.vertex) = out.height * out.slope;
      force.segment<3>(3 * c.vertex).setZero();
    }
    *cost = 0.5 * (squares + force.squaredNorm());
    if (!std::isfinite(*cost)) return false;
    if (gradient == nullptr) return true;
    const Eigen::VectorXd by_rest = p_.shell().gradientByRest(q_, rest).transpose() * pull;
    Eigen::Map<Eigen::VectorXd>(gradient, NumParameters()) = gathered(by_rest, p_.movable());
    return true;
  }

 private:
  /// h = g(u_N) + g(mu u_N - |u_T|), g(t) = max(0, -t) [Inv18] sec. 6.1, and dh/du.
  struct Outside {
    double height = 0.0;
    Vec3 slope = Vec3::Zero();
  };
  Outside outside(const Vec3& u, const Contact& c) const {
    const double mu = friction_share_ * c.friction, normal = u.dot(c.normal);
    const Vec3 tangent = u - normal * c.normal;
    Outside out;
    if (normal < 0.0) {
      out.height -= normal;
      out.slope -= c.normal;
    }
    if (const double beyond = tangent.norm() - mu * normal; beyond > 0.0) {
      out.height += beyond;
      out.slope -= mu * c.normal;
      if (tangent.norm() > 0.0) out.slope += tangent.normalized();
    }
    return out;
  }

  const Problem& p_;
  double lambda_, friction_share_;
  Points3 rest_;
  Eigen::VectorXd q_;
};

/// BFGS until nothing moves any more; leaves the best variables.
double minimize(std::unique_ptr<ceres::FirstOrderFunction> function, int iterations,
                Eigen::VectorXd& variables) {
  ceres::GradientProblem problem(function.release());
  ceres::GradientProblemSolver::Options options;
  options.line_search_direction_type = ceres::BFGS;
  options.max_num_iterations = iterations;
  options.function_tolerance = 0.0;
  options.gradient_tolerance = kTolerance;
  options.parameter_tolerance = kTolerance;
  options.logging_type = ceres::SILENT;
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(options, problem, variables.data(), &summary);
  return summary.final_cost;
}

}  // namespace

ReferenceResult invertByReference(const InverseShell& shell, const RestNewton& problem,
                                  double friction_share, RestUnknowns& unknowns,
                                  const ReferenceOptions& options) {
  ReferenceResult out;
  const Problem p(shell, problem, options);
  for (double lambda = kFirstLambda; !p.stopped();) {
    const auto flat = [&](const Points3& x) {
      return Eigen::Map<const Eigen::VectorXd>(x.data(), x.size());
    };
    Eigen::VectorXd variables = gathered(flat(unknowns.rest), p.free());
    if (variables.size() > 0) {
      minimize(std::make_unique<DrapeCost>(p, lambda, unknowns.rest, out), kDrapeIterations,
               variables);
      scatter(variables.data(), p.free(), unknowns.rest);
    }
    Eigen::VectorXd q = shell.coordinates(problem.pose(), unknowns.rotations);
    std::unique_ptr<ClothSystem> system;
    if (variables.size() > 0 &&
        !DrapeCost(p, lambda, unknowns.rest, out).drape(unknowns.rest, q, system))
      return out;
    unknowns.rotations = q.tail(shell.rotationCount());
    variables = gathered(flat(unknowns.rest), p.movable());
    const double cost =
        minimize(std::make_unique<ConeCost>(p, lambda, friction_share, unknowns.rest, q),
                 kConeIterations, variables);
    scatter(variables.data(), p.movable(), unknowns.rest);
    if (options.progress) options.progress(lambda, out.drapes, cost);
    if (lambda == 0.0) {
      out.finished = !p.stopped();
      break;
    }
    lambda *= 0.5;
    if (lambda < kLastLambda) lambda = 0.0;
  }
  return out;
}

}  // namespace tenter
