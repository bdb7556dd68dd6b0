// SPDX-License-Identifier: GPL-3.0-or-later
#include "hanging_curve.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tenter {
namespace {

constexpr int kMaxIterations = 100;
/// A start needs no more: change of angle in a step [rad].
constexpr double kEnough_rad = 1e-6;

/// Energy over width and its derivatives; the Hessian is tridiagonal.
struct Chain {
  double step_m, weight_N_per_m2;
  const std::function<BendingResponse(double)>& bending;

  /// Weight of all that hangs beyond the middle of a segment, per width.
  double load(std::size_t i, std::size_t count) const {
    return weight_N_per_m2 * step_m * (static_cast<double>(count - i) - 0.5);
  }

  double energy(const std::vector<double>& angles) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < angles.size(); ++i) {
      sum += share(i) * bending(curvature(angles, i)).energy;
      sum -= load(i, angles.size()) * step_m * std::sin(angles[i]);
    }
    return sum;
  }

  /// At the clamp half a segment bends: its angle lies half a step from the level part.
  double curvature(const std::vector<double>& angles, std::size_t i) const {
    return i == 0 ? 2.0 * angles[0] / step_m : (angles[i] - angles[i - 1]) / step_m;
  }
  double share(std::size_t i) const { return i == 0 ? 0.5 * step_m : step_m; }
};

/// Newton step by elimination in a symmetric tridiagonal matrix.
std::vector<double> newtonStep(const Chain& chain, const std::vector<double>& angles) {
  const std::size_t n = angles.size();
  std::vector<double> diagonal(n, 0.0), off(n, 0.0), step(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    const BendingResponse b = chain.bending(chain.curvature(angles, i));
    const double by_angle = i == 0 ? 2.0 / chain.step_m : 1.0 / chain.step_m;
    const double moment = chain.share(i) * b.moment * by_angle;
    // Softening laws have negative tangents; the secant keeps the step a descent.
    const double stiffness = chain.share(i) * std::max(b.tangent, 0.0) * by_angle * by_angle;
    diagonal[i] += stiffness;
    step[i] -= moment;
    if (i > 0) {
      diagonal[i - 1] += stiffness;
      off[i - 1] = -stiffness;
      step[i - 1] += moment;
    }
    const double load = chain.load(i, n) * chain.step_m;
    diagonal[i] += load * std::max(std::sin(angles[i]), 1e-3);
    step[i] += load * std::cos(angles[i]);
  }
  for (std::size_t i = 1; i < n; ++i) {
    const double factor = off[i - 1] / diagonal[i - 1];
    diagonal[i] -= factor * off[i - 1];
    step[i] -= factor * step[i - 1];
  }
  for (std::size_t i = n; i-- > 0;) {
    if (i + 1 < n) step[i] -= off[i] * step[i + 1];
    step[i] /= diagonal[i];
  }
  return step;
}

}  // namespace

std::vector<double> hangingAngles(double length_m, double weight_N_per_m2, int segments,
                                  const std::function<BendingResponse(double)>& bending) {
  const Chain chain{length_m / segments, weight_N_per_m2, bending};
  std::vector<double> angles(segments, 0.0);
  if (!(weight_N_per_m2 > 0.0)) return angles;
  double energy = chain.energy(angles);
  for (int k = 0; k < kMaxIterations; ++k) {
    const std::vector<double> step = newtonStep(chain, angles);
    double largest = 0.0;
    std::vector<double> trial(angles.size());
    for (double alpha = 1.0; alpha > 1e-4; alpha *= 0.5) {
      largest = 0.0;
      for (std::size_t i = 0; i < angles.size(); ++i) {
        trial[i] = std::clamp(angles[i] + alpha * step[i], 0.0, 0.5 * std::numbers::pi);
        largest = std::max(largest, std::abs(trial[i] - angles[i]));
      }
      if (chain.energy(trial) <= energy) break;
    }
    const double e = chain.energy(trial);
    if (!(e <= energy)) break;
    angles = trial;
    energy = e;
    if (largest < kEnough_rad) break;
  }
  return angles;
}

Eigen::Vector2d pointOnCurve(const std::vector<double>& angles, double length_m, double s) {
  if (s <= 0.0) return {s, 0.0};
  const double step = length_m / static_cast<double>(angles.size());
  Eigen::Vector2d point = Eigen::Vector2d::Zero();
  for (const double angle : angles) {
    const double piece = std::min(step, s);
    point += piece * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    s -= piece;
    if (s <= 0.0) break;
  }
  return point;
}

}  // namespace tenter
