// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/subset_warp.h"

namespace tenter {

namespace {

using Polynomial = SubsetWarp::Polynomial;

double valueAt(const Polynomial& p, double a, double b) {
  return p[0] + p[1] * a + p[2] * b + 0.5 * p[3] * a * a + p[4] * a * b + 0.5 * p[5] * b * b;
}

Polynomial moved(const Polynomial& p, double a, double b) {
  return {
      valueAt(p, a, b), p[1] + p[3] * a + p[4] * b, p[2] + p[4] * a + p[5] * b, p[3], p[4], p[5]};
}

}  // namespace

SubsetWarp SubsetWarp::translation(const Vec2& displacement_px) {
  return affine(displacement_px, Mat2::Identity());
}

SubsetWarp SubsetWarp::affine(const Vec2& displacement_px, const Mat2& linear) {
  SubsetWarp warp;
  warp.u = {displacement_px.x(), linear(0, 0) - 1.0, linear(0, 1), 0.0, 0.0, 0.0};
  warp.v = {displacement_px.y(), linear(1, 0), linear(1, 1) - 1.0, 0.0, 0.0, 0.0};
  return warp;
}

Vec2 SubsetWarp::displacementAt(const Vec2& offset_px) const {
  return {valueAt(u, offset_px.x(), offset_px.y()), valueAt(v, offset_px.x(), offset_px.y())};
}

Mat2 SubsetWarp::linear() const {
  Mat2 linear;
  linear << 1.0 + u[1], u[2], v[1], 1.0 + v[2];
  return linear;
}

SubsetWarp SubsetWarp::movedBy(const Vec2& offset_px) const {
  SubsetWarp warp;
  warp.u = moved(u, offset_px.x(), offset_px.y());
  warp.v = moved(v, offset_px.x(), offset_px.y());
  return warp;
}

}  // namespace tenter
