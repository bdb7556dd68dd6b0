// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/mechanics/dihedral_angle.h"

#include <array>
#include <cmath>
#include <limits>

#include "tenter/core/types.h"

namespace tenter {
namespace {

/// Triangle on an edge from `a` to `b` with apex `c`: what the first and second derivatives need.
struct Wing {
  Vec3 normal;     ///< Unit, n.
  Vec3 inward;     ///< Unit, in the plane, from the edge to the apex, u = n x t.
  Vec3 along;      ///< Unit edge direction t of this wing.
  double height;   ///< Of the apex over the edge.
  double share_a;  ///< Weight of `a` at the foot of the height; weight of `b` is 1 - share_a.
  double share_b;
};

bool makeWing(const Vec3& a, const Vec3& b, const Vec3& c, double length, Wing* wing) {
  const Vec3 edge = b - a;
  // The shorter leg loses fewer digits when the triangle is a sliver.
  const Vec3 from_a = c - a;
  const Vec3 from_b = c - b;
  const bool use_a = from_a.squaredNorm() <= from_b.squaredNorm();
  const Vec3 cross = edge.cross(use_a ? from_a : from_b);
  const double norm = cross.norm();
  if (!(norm > std::numeric_limits<double>::min())) return false;
  wing->normal = cross / norm;
  wing->along = edge / length;
  wing->inward = wing->normal.cross(wing->along);
  wing->height = norm / length;
  wing->share_a = -from_b.dot(wing->along) / length;
  wing->share_b = from_a.dot(wing->along) / length;
  return true;
}

// docs/mechanics-elements.md, "Dihedral angle": d theta / d(apex) = -n / h, shared out to a and b.
void addGradient(const Wing& w, int a, int b, int c, Vec12* gradient) {
  const Vec3 apex = w.normal / w.height;
  gradient->segment<3>(3 * c) -= apex;
  gradient->segment<3>(3 * a) += w.share_a * apex;
  gradient->segment<3>(3 * b) += w.share_b * apex;
}

void addHessian(const Wing& w, double length, int a, int b, int c, Mat12* hessian) {
  const double ih2 = 1.0 / (w.height * w.height);
  const double ihl = 1.0 / (w.height * length);
  const double half_il2 = 0.5 / (length * length);
  const Mat3 nu = w.normal * w.inward.transpose();
  const Mat3 nt = w.normal * w.along.transpose();
  const Mat3 s = nu + nu.transpose();
  const Mat3 t = nt + nt.transpose();
  const double fa = w.share_a, fb = w.share_b;
  const Mat3 ca = -(fa * ih2) * s - ihl * nt.transpose();
  const Mat3 cb = -(fb * ih2) * s + ihl * nt.transpose();
  const Mat3 ab = (fa * fb * ih2 - half_il2) * s + ihl * (fb * nt - fa * nt.transpose());
  hessian->block<3, 3>(3 * c, 3 * c) += ih2 * s;
  hessian->block<3, 3>(3 * c, 3 * a) += ca;
  hessian->block<3, 3>(3 * a, 3 * c) += ca.transpose();
  hessian->block<3, 3>(3 * c, 3 * b) += cb;
  hessian->block<3, 3>(3 * b, 3 * c) += cb.transpose();
  hessian->block<3, 3>(3 * a, 3 * a) += (fa * fa * ih2 + half_il2) * s + (fa * ihl) * t;
  hessian->block<3, 3>(3 * b, 3 * b) += (fb * fb * ih2 + half_il2) * s - (fb * ihl) * t;
  hessian->block<3, 3>(3 * a, 3 * b) += ab;
  hessian->block<3, 3>(3 * b, 3 * a) += ab.transpose();
}

}  // namespace

double dihedralAngle(const Vec12& x, Vec12* gradient, Mat12* hessian) {
  if (gradient != nullptr) gradient->setZero();
  if (hessian != nullptr) hessian->setZero();
  const Vec3 x0 = x.segment<3>(0), x1 = x.segment<3>(3);
  const Vec3 x2 = x.segment<3>(6), x3 = x.segment<3>(9);
  const double length = (x1 - x0).norm();
  Wing left, right;
  if (!(length > std::numeric_limits<double>::min())) return 0.0;
  if (!makeWing(x0, x1, x2, length, &left)) return 0.0;
  if (!makeWing(x1, x0, x3, length, &right)) return 0.0;
  if (gradient != nullptr) {
    addGradient(left, 0, 1, 2, gradient);
    addGradient(right, 1, 0, 3, gradient);
  }
  if (hessian != nullptr) {
    addHessian(left, length, 0, 1, 2, hessian);
    addHessian(right, length, 1, 0, 3, hessian);
  }
  const double sine = left.normal.cross(right.normal).dot(left.along);
  const double cosine = left.normal.dot(right.normal);
  return std::atan2(sine, cosine);
}

}  // namespace tenter
