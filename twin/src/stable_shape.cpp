// SPDX-License-Identifier: GPL-3.0-or-later
#include "stable_shape.h"

#include <cmath>

#include "virtual_cloth.h"

namespace tenter {
namespace {

constexpr int kFirstNewtonSteps = 20, kLastNewtonSteps = 60, kDescentSteps = 150;
constexpr double kFirstShift_N_per_m =
    0.05;  // bending of one node's share of a thin cloth, roughly
constexpr double kEase = 0.15,
                 kStiffen = 4.0;  // the shift after a full step, and after one cut short
constexpr double kLargestShift_N_per_m = 1e6;
constexpr double kDescentTolerance = 1e-2;  // of the lightest node's weight: Newton does the rest
constexpr double kLongestMove_m =
    0.004;  // a few meshes: farther, and sheets fold through themselves
constexpr double kArmijo = 1e-4;
constexpr double kSmallestShift_N_per_m = 1e-5;
constexpr double kFirstMove_m = 1e-6;
constexpr int kInverseIterations = 6;
constexpr int kMaxBacktracks = 30;

}  // namespace

StableShapeSolver::StableShapeSolver(const ClothSystem& system)
    : system_(system), newton_(system) {}

bool StableShapeSolver::solve(ClothState& state, CaptureStatistics& statistics) {
  const ClothState before = state;
  EquilibriumOptions options;
  options.max_iterations = kFirstNewtonSteps;
  EquilibriumSummary summary = newton_.solve(state, options);
  count(summary, statistics);
  if (!summary.converged() || !summary.stable) {
    state = before;
    descend(state, statistics);
    options.max_iterations = kLastNewtonSteps;
    summary = newton_.solve(state, options);
    count(summary, statistics);
  }
  const bool good = summary.converged() && summary.stable;
  if (good) {
    statistics.largest_residual_N = std::max(statistics.largest_residual_N, summary.residual_N);
  } else {
    state = before;
  }
  return good;
}

bool StableShapeSolver::factorizeShifted(const ClothState& state, double& shift,
                                         CaptureStatistics& statistics) {
  const SparseLower& h = system_.hessian(state, Projection::kNone);
  if (shifted_.rows() == 0) {
    shifted_ = Eigen::Map<const Eigen::SparseMatrix<double>>(
        h.size, h.size, static_cast<Eigen::Index>(h.value.size()), h.column_begin.data(),
        h.row.data(), h.value.data());
    cholesky_.analyzePattern(shifted_);
  }
  for (; shift <= kLargestShift_N_per_m;
       shift = std::max(kStiffen * shift, kSmallestShift_N_per_m)) {
    std::copy(h.value.begin(), h.value.end(), shifted_.valuePtr());
    for (int c = 0; c < h.size; ++c) shifted_.valuePtr()[h.column_begin[c]] += shift;
    cholesky_.factorize(shifted_);
    ++statistics.factorizations;
    if (cholesky_.info() == Eigen::Success) return true;
  }
  return false;
}

bool StableShapeSolver::lineSearch(ClothState& state, double& energy) {
  const double slope = gradient_.dot(step_);
  double scale = std::min(1.0, kLongestMove_m / step_.cwiseAbs().maxCoeff());
  for (int k = 0; k < kMaxBacktracks; ++k, scale *= 0.5) {
    ClothState trial = state;
    system_.advance(trial, step_, scale);
    const double lower = system_.energy(trial);
    if (!(lower <= energy + kArmijo * scale * slope)) continue;
    state = std::move(trial);
    energy = lower;
    return k == 0;
  }
  return false;
}

void StableShapeSolver::leaveRidge(ClothState& state, double& energy) {
  // Inverse iteration: the factors at hand are those of H + shift I with the shift just large
  // enough.
  Eigen::VectorXd direction(system_.dofCount());
  for (Eigen::Index i = 0; i < direction.size(); ++i)
    direction[i] = std::sin(1.0 + 2.399963 * static_cast<double>(i));
  for (int k = 0; k < kInverseIterations; ++k) direction = cholesky_.solve(direction).normalized();
  direction /= direction.cwiseAbs().maxCoeff();
  ClothState lowest = state;
  double lowest_energy = energy;
  for (double length = kFirstMove_m; length <= kLongestMove_m; length *= 3.0) {
    for (const double sign : {1.0, -1.0}) {
      ClothState trial = state;
      system_.advance(trial, direction, sign * length);
      const double there = system_.energy(trial);
      if (!(there < lowest_energy)) continue;
      lowest_energy = there;
      lowest = std::move(trial);
    }
  }
  state = std::move(lowest);
  energy = lowest_energy;
}

void StableShapeSolver::descend(ClothState& state, CaptureStatistics& statistics) {
  const double tolerance = kDescentTolerance * system_.lightestFreeNodeWeight_N();
  double energy = system_.energy(state), shift = kFirstShift_N_per_m;
  for (int k = 0; k < kDescentSteps; ++k) {
    system_.gradient(state, gradient_);
    const bool still = gradient_.cwiseAbs().maxCoeff() <= tolerance;
    if (still) shift = 0.0;
    if (!factorizeShifted(state, shift, statistics)) return;
    if (still && shift == 0.0) return;
    if (still) leaveRidge(state, energy);
    if (still) continue;
    step_ = -cholesky_.solve(gradient_);
    ++statistics.newton_steps;
    shift *= lineSearch(state, energy) ? kEase : kStiffen;
  }
}

}  // namespace tenter
