// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <numbers>

namespace tenter {

/// angle - rest, both in (-pi, pi], unwrapped into (-pi, pi]: a hinge may pass through the fold at
/// pi.
inline double angleDifference(double angle, double rest) {
  constexpr double kPi = std::numbers::pi;
  const double d = angle - rest;
  if (d > kPi) return d - 2.0 * kPi;
  if (d <= -kPi) return d + 2.0 * kPi;
  return d;
}

}  // namespace tenter
