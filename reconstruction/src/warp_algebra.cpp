// SPDX-License-Identifier: GPL-3.0-or-later
#include "warp_algebra.h"

#include <Eigen/LU>
#include <cmath>

namespace tenter {

namespace {

using Mat6 = Eigen::Matrix<double, 6, 6>;

Mat3 affineMatrix(const SubsetWarp& w) {
  Mat3 m;
  m << 1.0 + w.u[1], w.u[2], w.u[0],  //
      w.v[1], 1.0 + w.v[2], w.v[0],   //
      0.0, 0.0, 1.0;
  return m;
}

/// What the warp makes of (a^2, ab, b^2, a, b, 1), terms above the second degree left out.
Mat6 quadraticMatrix(const SubsetWarp& w) {
  const auto [u, ux, uy, uxx, uxy, uyy] = w.u;
  const auto [v, vx, vy, vxx, vxy, vyy] = w.v;
  const double x = 1.0 + ux, y = 1.0 + vy;
  Mat6 m;
  m << x * x + u * uxx, 2.0 * (u * uxy + x * uy), uy * uy + u * uyy, 2.0 * u * x, 2.0 * u * uy,
      u * u,  //
      0.5 * (v * uxx + u * vxx) + x * vx, x * y + uy * vx + v * uxy + u * vxy,
      0.5 * (v * uyy + u * vyy) + uy * y, v * x + u * vx, u * y + v * uy, u * v,  //
      vx * vx + v * vxx, 2.0 * (v * vxy + vx * y), y * y + v * vyy, 2.0 * v * vx, 2.0 * v * y,
      v * v,                                //
      0.5 * uxx, uxy, 0.5 * uyy, x, uy, u,  //
      0.5 * vxx, vxy, 0.5 * vyy, vx, y, v,  //
      0.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  return m;
}

}  // namespace

bool composeWithInverse(SubsetWarp& warp, const SubsetWarp& increment, int order) {
  SubsetWarp updated;
  if (order == 1) {
    const Mat3 m = affineMatrix(warp) * affineMatrix(increment).inverse();
    updated.u = {m(0, 2), m(0, 0) - 1.0, m(0, 1), 0.0, 0.0, 0.0};
    updated.v = {m(1, 2), m(1, 0), m(1, 1) - 1.0, 0.0, 0.0, 0.0};
  } else {
    const Mat6 m = quadraticMatrix(warp) * quadraticMatrix(increment).inverse();
    updated.u = {m(3, 5), m(3, 3) - 1.0, m(3, 4), 2.0 * m(3, 0), m(3, 1), 2.0 * m(3, 2)};
    updated.v = {m(4, 5), m(4, 3), m(4, 4) - 1.0, 2.0 * m(4, 0), m(4, 1), 2.0 * m(4, 2)};
  }
  for (std::size_t k = 0; k < updated.u.size(); ++k) {
    if (!std::isfinite(updated.u[k]) || !std::isfinite(updated.v[k])) return false;
  }
  warp = updated;
  return true;
}

}  // namespace tenter
