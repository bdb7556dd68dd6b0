// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/core/types.h"

namespace tenter {

/// The matrix of v x: crossMatrix(v) * w = v.cross(w).
inline Mat3 crossMatrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace tenter
