// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/certificate.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>

#include "tenter/mechanics/dihedral_angle.h"
#include "tenter/mechanics/equilibrium.h"

namespace tenter {
namespace {

/// Forces smaller than this, of the weight, are rounding.
constexpr double kNoForce = 1e-12;
/// Margin of a force that leaves its cone where the cone has no size to compare with.
constexpr double kFarOutside = -1e9;
/// Re-drapings converge to this, of a vertex's mean weight.
constexpr double kRedrapeForce = 1e-7;
constexpr int kRedrapeIterations = 200;

double marginOf(const Vec3& force, const Contact& contact, double weight) {
  if (force.norm() <= kNoForce * weight) return 1.0;
  const double normal = force.dot(contact.normal);
  const double tangent = (force - normal * contact.normal).norm();
  if (tangent <= kNoForce * weight && normal >= 0.0) return 1.0;
  if (!(contact.friction * normal > 0.0)) return kFarOutside;
  return 1.0 - tangent / (contact.friction * normal);
}

Eigen::VectorXd gradientOf(const ClothSystem& system, const Eigen::VectorXd& q) {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(q.size());
  for (const auto& term : system.terms()) term->addGradient(q, gradient);
  return gradient;
}

void clear(const std::vector<int>& fixed, const std::vector<Contact>& contacts,
           Eigen::VectorXd& forces) {
  for (const int v : fixed) forces.segment<3>(3 * v).setZero();
  for (const Contact& c : contacts) forces.segment<3>(3 * c.vertex).setZero();
}

/// One unit in the last place of every coordinate, up or down by chance, scaled to the standard
/// deviation of rounding (a twelfth of its square), in the pose and as much again in the rest
/// shape.
double roundingOf(const ClothSystem& system, const Eigen::VectorXd& q,
                  const Eigen::VectorXd& gradient, const std::vector<int>& fixed,
                  const std::vector<Contact>& contacts) {
  constexpr int kSamples = 4;
  std::mt19937 random(1);
  double squares = 0.0;
  for (int sample = 0; sample < kSamples; ++sample) {
    Eigen::VectorXd moved = q;
    for (double& coordinate : moved) {
      const double towards = (random() & 1U) != 0 ? 1e300 : -1e300;
      coordinate = std::nextafter(coordinate, towards);
    }
    Eigen::VectorXd change = gradientOf(system, moved) - gradient;
    clear(fixed, contacts, change);
    squares += change.head(3 * system.sheet().nodeCount()).squaredNorm();
  }
  return std::sqrt(2.0 * squares / (12.0 * kSamples));
}

void measureForces(const Eigen::VectorXd& gradient, const std::vector<int>& fixed,
                   const std::vector<Contact>& contacts, Certificate& out) {
  Eigen::VectorXd free = gradient;
  clear(fixed, contacts, free);
  for (const Contact& c : contacts) {
    const Vec3 force = gradient.segment<3>(3 * c.vertex);
    const double margin = marginOf(force, c, out.weight_N);
    out.cone_margins.push_back(margin);
    out.contact_holds.push_back(force.dot(c.normal) > kHeldContactForce * out.weight_N);
    out.cone_margin_min = std::min(out.cone_margin_min, margin);
    // A force on the cone's very border is inside; rounding must not decide.
    if (margin < -1e-9) ++out.cone_violations;
  }
  out.force_residual_rel = free.norm() / out.weight_N;
}

int negativePivots(const SparseLower& h) {
  const Eigen::Map<const Eigen::SparseMatrix<double>> lower(
      h.size, h.size, static_cast<Eigen::Index>(h.value.size()), h.column_begin.data(),
      h.row.data(), h.value.data());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor(
      Eigen::SparseMatrix<double>{lower});
  return static_cast<int>((factor.vectorD().array() < 0.0).count());
}

void measureStability(const ClothSystem& system, const ClothState& state, Certificate& out) {
  EquilibriumSolver solver(system);
  ClothState copy = state;
  EquilibriumOptions options;
  options.force_tolerance_N = out.weight_N;  // the pose is taken as it is
  options.leave_saddles = false;
  options.compute_lambda_min = true;
  const EquilibriumSummary summary = solver.solve(copy, options);
  out.lambda_min_per_s2 = summary.lambda_min_per_s2;
  out.lambda_residual_per_s2 = summary.lambda_min_residual_per_s2;
  if (!summary.stable)
    out.negative_eigenvalues = negativePivots(system.hessian(state, Projection::kNone));
  out.measured_stability = true;
}

/// Where contacts and supports hold every vertex only edge rotations are free, and they carry no
/// mass: stable if their own stiffness is positive, with no eigenvalue to speak of.
void certifyHeld(const ClothSystem& system, const Eigen::VectorXd& q, int positions,
                 Certificate& out) {
  ClothState state = system.restState();
  state.q = q;
  SparseLower h = system.hessian(state, Projection::kNone);
  const int first = h.size - (static_cast<int>(q.size()) - positions);
  SparseLower rotations;
  rotations.size = h.size - first;
  rotations.column_begin.push_back(0);
  for (int c = first; c < h.size; ++c) {
    for (int k = h.column_begin[c]; k < h.column_begin[c + 1]; ++k) {
      rotations.row.push_back(h.row[k] - first);
      rotations.value.push_back(h.value[k]);
    }
    rotations.column_begin.push_back(static_cast<int>(rotations.row.size()));
  }
  out.negative_eigenvalues = rotations.size > 0 ? negativePivots(rotations) : 0;
  out.lambda_min_per_s2 = std::numeric_limits<double>::infinity();
  out.measured_stability = true;
  out.complete = true;
}

ClothState perturbed(const ClothState& state, const std::vector<char>& held, double length_m,
                     unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) / 2147483647.5 - 1.0; };
  ClothState out = state;
  for (std::size_t v = 0; v < held.size(); ++v) {
    Vec3 d;
    do {
      d = Vec3(uniform(), uniform(), uniform());
    } while (d.norm() > 1.0 || d.norm() < 0.1);
    if (!held[v]) out.q.segment<3>(3 * static_cast<Eigen::Index>(v)) += length_m * d.normalized();
  }
  return out;
}

/// False when it was stopped.
bool redrape(const InverseShell& shell, const Points3& rest, const std::vector<int>& held,
             const ClothState& state, const CertificateOptions& options, Certificate& out) {
  std::vector<char> is_held(static_cast<std::size_t>(shell.vertexCount()), 0);
  for (const int v : held) is_held[v] = 1;
  struct Bench {
    ClothSystem system;
    EquilibriumSolver solver;
    explicit Bench(ClothSystem s) : system(std::move(s)), solver(system) {}
    Bench(Bench&&) = delete;
  };
  tbb::enumerable_thread_specific<std::unique_ptr<Bench>> benches;
  out.redrape_rel.assign(static_cast<std::size_t>(options.redrapes), 0.0);
  std::atomic<bool> stopped = false;
  EquilibriumOptions solving;
  solving.max_iterations = kRedrapeIterations;
  solving.force_tolerance_N = kRedrapeForce * out.weight_N / shell.vertexCount();
  solving.cancelled = [&] {
    if (options.stop && options.stop()) stopped = true;
    return stopped.load();
  };
  tbb::parallel_for(0, options.redrapes, [&](int k) {
    if (solving.cancelled()) return;
    auto& bench = benches.local();
    if (!bench) bench = std::make_unique<Bench>(shell.system(rest, held).value());
    ClothState moved = perturbed(state, is_held, options.perturbation_rel * out.size_m,
                                 options.seed + static_cast<unsigned>(k));
    bench->solver.solve(moved, solving);
    const Eigen::Index n = shell.vertexCount();
    out.redrape_rel[static_cast<std::size_t>(k)] =
        (moved.positions(static_cast<int>(n)) - state.positions(static_cast<int>(n)))
            .colwise()
            .norm()
            .maxCoeff() /
        out.size_m;
  });
  if (stopped) return false;
  for (const double d : out.redrape_rel) out.redrape_max_rel = std::max(out.redrape_max_rel, d);
  return true;
}

void measureShape(const InverseShell& shell, const Points3& pose, const Points3& rest,
                  Certificate& out) {
  const auto& edges = shell.topology().edges;
  out.stretch = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(edges.size()));
  out.bend_rad = out.stretch;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [i, j] = edges[e].vertices;
    const auto at = static_cast<Eigen::Index>(e);
    const double length = (pose.col(j) - pose.col(i)).norm();
    const auto& metric = shell.elementRest();
    const double rest_length = metric ? metric->length_m[at] : (rest.col(j) - rest.col(i)).norm();
    out.stretch[at] = (rest_length - length) / length;
    if (edges[e].triangles[1] < 0) continue;
    Vec12 x, r;
    const std::array<int, 4> ids{i, j, edges[e].opposite[0], edges[e].opposite[1]};
    for (int k = 0; k < 4; ++k) {
      x.segment<3>(3 * k) = pose.col(ids[k]);
      r.segment<3>(3 * k) = rest.col(ids[k]);
    }
    const double rest_angle = metric ? metric->angle_rad[at] : dihedralAngle(r);
    out.bend_rad[at] =
        std::abs(std::remainder(rest_angle - dihedralAngle(x), 2.0 * std::numbers::pi));
  }
}

}  // namespace

Result<Certificate> certify(const InverseShell& shell, const Points3& pose, const Points3& rest,
                            const Eigen::VectorXd& rotations, const std::vector<int>& fixed,
                            const std::vector<Contact>& contacts,
                            const CertificateOptions& options) {
  Certificate out;
  out.size_m = sizeOf(pose);
  out.weight_N = shell.weight_N(rest);
  measureShape(shell, pose, rest, out);
  std::vector<int> held = fixed;
  auto all_free = shell.system(rest, fixed);
  if (!all_free) return all_free.error();
  const Eigen::VectorXd q = shell.coordinates(pose, rotations);
  const Eigen::VectorXd gradient = gradientOf(*all_free, q);
  measureForces(gradient, fixed, contacts, out);
  out.force_rounding_rel = roundingOf(*all_free, q, gradient, fixed, contacts) / out.weight_N;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (out.contact_holds[i]) held.push_back(contacts[i].vertex);
  if (options.stop && options.stop()) return out;
  if (static_cast<int>(held.size()) == shell.vertexCount()) {
    certifyHeld(*all_free, q, 3 * shell.vertexCount(), out);
    out.redrape_rel.assign(static_cast<std::size_t>(options.redrapes), 0.0);
    return out;
  }
  auto system = shell.system(rest, held);
  if (!system) return system.error();
  ClothState state = system->restState();
  state.q = q;
  measureStability(*system, state, out);
  // Of what is no stable equilibrium re-draping says nothing more.
  if (!out.stable() || !out.balanced() || (options.stop && options.stop())) return out;
  out.complete = redrape(shell, rest, held, state, options, out);
  return out;
}

}  // namespace tenter
