// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/core/types.h"

namespace tenter {

/// Friction cone |f_T| <= mu f_N about a unit normal, and the nearest point of it.
struct ConeProjection {
  Vec3 point;
  Mat3 derivative;  ///< Of the point by the argument; one of its generalised derivatives on kinks.
};
ConeProjection projectOnFrictionCone(const Vec3& force, const Vec3& normal, double friction);

/// Nesterov and Todd's scaling of a pair s, z inside the cone |(y1, y2)| <= y0: W symmetric with
/// W z = W^-1 s = lambda.
struct ConeScaling {
  Mat3 w, w_inverse;
  Vec3 lambda;
};
ConeScaling scaleCone(const Vec3& s, const Vec3& z);

/// x o y = (x . y, x0 y_T + y0 x_T), and the y with x o y = r.
Vec3 coneProduct(const Vec3& x, const Vec3& y);
Vec3 coneQuotient(const Vec3& r, const Vec3& x);

/// Largest a >= 0 with x + a d in the cone, x inside it; infinity if none.
double stepToCone(const Vec3& x, const Vec3& d);

}  // namespace tenter
