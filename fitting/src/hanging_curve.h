// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace tenter {

/// Bending energy per area W(kappa) [J/m^2] and its first two derivatives.
struct BendingResponse {
  double energy = 0.0, moment = 0.0, tangent = 0.0;
};

/// Shape of an inextensible strip clamped horizontally and hanging under its weight: angle below
/// the horizontal of each of `segments` equal pieces. The energy is convex in the angles between 0
/// and 90 degrees, so Newton's method finds the shape for any weight.
std::vector<double> hangingAngles(double length_m, double weight_N_per_m2, int segments,
                                  const std::function<BendingResponse(double kappa)>& bending);

/// Point at arc length s: (distance from the clamp, drop) [m]. Straight and level for s < 0.
Eigen::Vector2d pointOnCurve(const std::vector<double>& angles, double length_m, double s);

}  // namespace tenter
