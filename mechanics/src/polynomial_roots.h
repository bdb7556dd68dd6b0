// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace tenter {

/// Roots of a t^2 + b t + c strictly inside (from, to), ascending; none if all coefficients are 0.
std::vector<double> quadraticRoots(double a, double b, double c, double from, double to);

/// Roots of p0 + p1 t + p2 t^2 + p3 t^3 strictly inside (from, to) where the sign changes,
/// ascending.
std::vector<double> cubicRoots(const double (&p)[4], double from, double to);

}  // namespace tenter
