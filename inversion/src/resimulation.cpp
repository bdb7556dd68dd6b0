// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/resimulation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <utility>

#include "tenter/inversion/certificate.h"
#include "tenter/mechanics/sparse_cholesky.h"

namespace tenter {
namespace {

using Clock = std::chrono::steady_clock;

/// Gap up to which a vertex without force still touches, of the size.
constexpr double kTouching = 1e-6;

/// Vertices that fixed places and contacts with a force hold.
Result<std::vector<int>> heldVertices(const InverseShell& shell, const ShellStart& start,
                                      const Eigen::VectorXd& q) {
  auto system = shell.system(start.rest, start.fixed);
  if (!system) return system.error();
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(q.size());
  for (const auto& term : system->terms()) term->addGradient(q, gradient);
  std::vector<int> held = start.fixed;
  const double least = kHeldContactForce * shell.weight_N(start.rest);
  for (const Contact& c : start.contacts)
    if (gradient.segment<3>(3 * c.vertex).dot(c.normal) > least) held.push_back(c.vertex);
  return held;
}

/// No value where the pose is not stable, or nothing is free.
std::optional<LinearResponse> linearResponse(const InverseShell& shell, const ShellStart& start,
                                             const Eigen::VectorXd& q, const Vec3& gravity_change) {
  const auto held = heldVertices(shell, start, q);
  if (!held || static_cast<int>(held->size()) == shell.vertexCount()) return {};
  const auto system = shell.system(start.rest, *held);
  if (!system) return {};
  ClothState state = system->restState();
  state.q = q;
  SparseCholesky cholesky(system->hessian(state, Projection::kNone));
  if (!cholesky.factorize(system->hessian(state, Projection::kNone))) return {};
  // Free vertices come first among the degrees of freedom; rotations have no mass.
  const Eigen::Index positions =
      3 * (shell.vertexCount() - static_cast<Eigen::Index>(held->size()));
  Eigen::VectorXd load = system->dofMass(), moved;
  for (Eigen::Index i = 0; i < positions; ++i) load[i] *= gravity_change[i % 3];
  cholesky.solve(load, moved);
  LinearResponse out;
  for (Eigen::Index i = 0; i < positions; i += 3)
    out.displacement_rel = std::max(out.displacement_rel, moved.segment<3>(i).norm());
  out.displacement_rel /= sizeOf(start.pose);
  return out;
}

Points3 randomDisplacements(int count, double length_m, unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) / 2147483647.5 - 1.0; };
  Points3 out(3, count);
  for (int v = 0; v < count; ++v) {
    Vec3 d;
    do {
      d = Vec3(uniform(), uniform(), uniform());
    } while (d.norm() > 1.0 || d.norm() < 0.1);
    out.col(v) = length_m * d.normalized();
  }
  return out;
}

void countContacts(const std::vector<VertexContact>& contacts, const std::vector<Contact>& start,
                   double size_m, ResimulationSummary& out) {
  std::vector<char> touched(contacts.size(), 0);
  for (const Contact& c : start) touched[static_cast<std::size_t>(c.vertex)] = 1;
  for (std::size_t v = 0; v < contacts.size(); ++v) {
    const VertexContact& c = contacts[v];
    const bool touches = c.mode != ContactMode::kOff || c.gap_m <= kTouching * size_m;
    if (!touches) {
      out.off += touched[v];
      continue;
    }
    out.landed += touched[v] == 0 ? 1 : 0;
    ++(c.mode == ContactMode::kSliding ? out.sliding : out.stuck);
  }
}

class Run {
 public:
  Run(const ResimulationOptions& options, const FrameSink& sink) : options_(options), sink_(sink) {}

  Result<ResimulationSummary> run(StoredInversion inversion) {
    const InversionProblem& problem = inversion.problem;
    auto shell = InverseShell::create(problem.target, problem.material, problem.frames);
    if (!shell) return shell.error();
    ShellStart start{options_.rest_is_target ? problem.target.positions : inversion.rest,
                     problem.target.positions, problem.fixed, problem.contacts};
    const Vec3 gravity = problem.material.gravity_m_per_s2;
    out_.size_m = sizeOf(start.pose);
    out_.weight_N = shell->weight_N(start.rest);
    if (!options_.rest_is_target) shell->setElementRest(inversion.element_rest);
    shell->setGravity(options_.gravity_scale * gravity);
    auto dynamics = ShellDynamics::create(*shell, start, obstaclesOf(inversion), dynamicsOptions());
    if (!dynamics) return dynamics.error();
    shell->setGravity(gravity);
    if (options_.gravity_scale != 1.0 && !options_.rest_is_target) {
      out_.linear = linearResponse(*shell, start, dynamics->coordinates(),
                                   (options_.gravity_scale - 1.0) * gravity);
    }
    if (options_.perturbation_rel > 0.0) displace(*dynamics, start);
    if (auto done = march(*dynamics); !done) return done.error();
    finish(*dynamics, start);
    return out_;
  }

 private:
  double elapsed_s() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }
  bool outOfTime() const {
    return options_.time_budget_s > 0.0 && elapsed_s() > options_.time_budget_s;
  }

  DynamicsOptions dynamicsOptions() const {
    DynamicsOptions dynamics = options_.dynamics;
    dynamics.stop = [this] {
      return (options_.dynamics.stop && options_.dynamics.stop()) || outOfTime();
    };
    return dynamics;
  }

  std::vector<MovingObstacle> obstaclesOf(StoredInversion& inversion) const {
    std::vector<MovingObstacle> out;
    for (auto& body : inversion.obstacles) {
      MovingObstacle obstacle;
      obstacle.body = std::move(body);
      obstacle.friction = inversion.friction;
      if (out.size() < options_.motions.size()) obstacle.motion = options_.motions[out.size()];
      out.push_back(std::move(obstacle));
    }
    return out;
  }

  /// Contacts stay in their places, so that no vertex starts inside an obstacle.
  void displace(ShellDynamics& dynamics, const ShellStart& start) const {
    Points3 moved = randomDisplacements(static_cast<int>(start.pose.cols()),
                                        options_.perturbation_rel * out_.size_m, options_.seed);
    for (const Contact& c : start.contacts) moved.col(c.vertex).setZero();
    dynamics.displace(moved);
  }

  Result<void> march(ShellDynamics& dynamics) {
    out_.energy_start_J = dynamics.energy_J();
    if (auto done = hand(dynamics); !done) return done;
    const auto frames = static_cast<int>(std::ceil(options_.seconds / options_.frame_s - 1e-9));
    for (int k = 1; k <= frames; ++k) {
      const AdvanceEnd end = dynamics.advanceTo(std::min(options_.seconds, k * options_.frame_s));
      if (end == AdvanceEnd::kReached) {
        if (auto done = hand(dynamics); !done) return done;
        continue;
      }
      out_.end = end == AdvanceEnd::kStuckInTime ? ResimulationEnd::kStuckInTime
                 : outOfTime()                   ? ResimulationEnd::kBudget
                                                 : ResimulationEnd::kStopped;
      break;
    }
    return {};
  }

  Result<void> hand(const ShellDynamics& dynamics) {
    ++out_.frames;
    return sink_(
        {dynamics.time_s(), dynamics.positions(), dynamics.velocities(), &dynamics.contacts()});
  }

  void finish(const ShellDynamics& dynamics, const ShellStart& start) {
    out_.counts = dynamics.counts();
    out_.simulated_s = dynamics.time_s();
    out_.max_displacement_rel = out_.counts.largest_displacement_m / out_.size_m;
    out_.end_displacement_rel =
        (dynamics.positions() - start.pose).colwise().norm().maxCoeff() / out_.size_m;
    countContacts(dynamics.contacts(), start.contacts, out_.size_m, out_);
    if (out_.linear && out_.linear->displacement_rel > 0.0)
      out_.linear->ratio = out_.max_displacement_rel / out_.linear->displacement_rel;
    out_.energy_end_J = dynamics.energy_J();
    out_.kinetic_end_J = dynamics.kineticEnergy_J();
    out_.tolerance_N = dynamics.tolerance_N();
    out_.seconds = elapsed_s();
  }

  const ResimulationOptions& options_;
  const FrameSink& sink_;
  Clock::time_point begin_ = Clock::now();
  ResimulationSummary out_;
};

}  // namespace

std::string name(ResimulationEnd end) {
  constexpr const char* kNames[] = {"complete", "stopped", "budget", "not_converged"};
  return kNames[static_cast<std::size_t>(end)];
}

Result<ResimulationSummary> resimulate(StoredInversion inversion,
                                       const ResimulationOptions& options, const FrameSink& sink) {
  return Run(options, sink).run(std::move(inversion));
}

}  // namespace tenter
