// SPDX-License-Identifier: GPL-3.0-or-later
#include "second_order_cone.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace tenter {
namespace {

double determinant(const Vec3& x) {
  const double t = std::hypot(x[1], x[2]);
  return (x[0] - t) * (x[0] + t);
}

Mat3 reflection() { return Vec3(1.0, -1.0, -1.0).asDiagonal(); }

}  // namespace

ConeProjection projectOnFrictionCone(const Vec3& force, const Vec3& normal, double friction) {
  const double n = force.dot(normal);
  const Vec3 tangent = force - n * normal;
  const double t = tangent.norm();
  if (t <= friction * n) return {force, Mat3::Identity()};
  if (friction * t <= -n) return {Vec3::Zero(), Mat3::Zero()};
  const Vec3 u = tangent / t;
  const Vec3 ray = normal + friction * u;
  const double scale = 1.0 / (1.0 + friction * friction);
  const double along = (n + friction * t) * scale;
  const Mat3 across = Mat3::Identity() - normal * normal.transpose() - u * u.transpose();
  return {along * ray, scale * ray * ray.transpose() + (friction * along / t) * across};
}

ConeScaling scaleCone(const Vec3& s, const Vec3& z) {
  const double ds = std::max(determinant(s), std::numeric_limits<double>::min());
  const double dz = std::max(determinant(z), std::numeric_limits<double>::min());
  const Vec3 s1 = s / std::sqrt(ds), z1 = z / std::sqrt(dz);
  const double gamma = std::sqrt(0.5 * (1.0 + s1.dot(z1)));
  const Vec3 centre = (s1 + reflection() * z1) / (2.0 * gamma);
  const Vec3 v = (centre + Vec3::UnitX()) / std::sqrt(2.0 * (centre[0] + 1.0));
  const Vec3 mirrored = reflection() * v;
  const double beta = std::pow(ds / dz, 0.25);
  ConeScaling out;
  out.w = beta * (2.0 * v * v.transpose() - reflection());
  out.w_inverse = (2.0 * mirrored * mirrored.transpose() - reflection()) / beta;
  out.lambda = out.w * z;
  return out;
}

Vec3 coneProduct(const Vec3& x, const Vec3& y) {
  Vec3 out = x[0] * y + y[0] * x;
  out[0] = x.dot(y);
  return out;
}

Vec3 coneQuotient(const Vec3& r, const Vec3& x) {
  Mat3 arrow = x[0] * Mat3::Identity();
  arrow.row(0) = x.transpose();
  arrow.col(0) = x;
  return arrow.inverse() * r;
}

double stepToCone(const Vec3& x, const Vec3& d) {
  const double a = determinant(d);
  const double b = x[0] * d[0] - x[1] * d[1] - x[2] * d[2];
  const double c = determinant(x);
  constexpr double kNone = std::numeric_limits<double>::infinity();
  // a t^2 + 2 b t + c = 0, c > 0: the smallest positive root, where the point leaves the cone.
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0) return kNone;
  const double root = std::sqrt(discriminant);
  const double sum = b >= 0.0 ? -(b + root) : -b + root;
  double best = kNone;
  for (const double t : {a != 0.0 ? sum / a : kNone, sum != 0.0 ? c / sum : kNone})
    if (t > 0.0) best = std::min(best, t);
  return best;
}

}  // namespace tenter
