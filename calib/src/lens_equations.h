// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace tenter::lens_equations {

/// Equation of `Lens`, for any number type: what the calibration fits and what everybody projects
/// with is one piece of code. `rational`: whether k4 to k6 exist in `distortion`.
template <bool rational, class T>
void distort(const T* distortion, const T& x, const T& y, T& x_d, T& y_d) {
  const T &k1 = distortion[0], &k2 = distortion[1], &p1 = distortion[2], &p2 = distortion[3],
          &k3 = distortion[4];
  const T r2 = x * x + y * y;
  T radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  if constexpr (rational) {
    radial /= 1.0 + r2 * (distortion[5] + r2 * (distortion[6] + r2 * distortion[7]));
  }
  x_d = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
  y_d = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
}

}  // namespace tenter::lens_equations
