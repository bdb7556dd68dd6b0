// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <utility>

#include "tenter/twin/specimen_law.h"

namespace tenter {
namespace {

constexpr double kRound = FrictionalLaw::kRounding;

/// Integral of h, h and dh/dt at t >= 0: straight, a parabola around t = 1, constant.
struct SliderValue {
  double energy, stress, tangent;
};

SliderValue slider(double t) {
  if (t <= 1.0 - kRound) return {0.5 * t * t, t, 1.0};
  const double d = t - (1.0 - kRound);
  if (t < 1.0 + kRound) {
    return {0.5 * t * t - d * d * d / (12.0 * kRound), t - d * d / (4.0 * kRound),
            1.0 - d / (2.0 * kRound)};
  }
  const double past = t - (1.0 + kRound);
  constexpr double kEnd = 1.0 + kRound;
  return {0.5 * kEnd * kEnd - 2.0 * kRound * kRound / 3.0 + past, 1.0, 0.0};
}

}  // namespace

FrictionalLaw::FrictionalLaw(std::shared_ptr<const StrainLaw> elastic,
                             const FrictionConstants& constants, int elements)
    : elastic_(std::move(elastic)), c_(constants), slip_(Eigen::Matrix3Xd::Zero(3, elements)) {
  require(c_.yield_N_per_m.minCoeff() >= 0.0 && c_.slip_strain.minCoeff() > 0.0,
          "FrictionalLaw: yields must not be negative, slip strains positive");
}

LawValue FrictionalLaw::evaluate(const Vec3& strain, int element) const {
  LawValue out = elastic_->evaluate(strain, element);
  for (int i = 0; i < 3; ++i) {
    const double y = c_.yield_N_per_m[i], scale = c_.slip_strain[i];
    const double t = (strain[i] - slip_(i, element)) / scale;
    const SliderValue s = slider(std::abs(t));
    out.energy += y * scale * s.energy;
    out.stress[i] += std::copysign(y * s.stress, t);
    out.tangent(i, i) += y / scale * s.tangent;
  }
  return out;
}

double FrictionalLaw::commit(const Vec3& strain, int element) {
  double dissipated = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double reach = (1.0 + kRound) * c_.slip_strain[i];
    const double offset = strain[i] - slip_(i, element);
    const double moved = std::abs(offset) - reach;
    if (moved <= 0.0) continue;
    slip_(i, element) += std::copysign(moved, offset);
    dissipated += c_.yield_N_per_m[i] * moved;
  }
  return dissipated;
}

}  // namespace tenter
