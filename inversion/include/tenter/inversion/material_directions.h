// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/inversion/inverse_shell.h"

namespace tenter {

/// Frames of a target whose warp runs along a direction in space, as far as each triangle's plane
/// allows: its projection there. Of several directions a triangle takes the first that is not
/// nearly across its plane. Weft x warp is the triangle's normal. Error that names the triangle
/// when none serves.
Result<std::vector<MaterialFrame>> framesAlong(const TriangleMesh& target,
                                               const std::vector<Vec3>& warp);

/// The same with a direction for every triangle, 3 x triangles: what warpOf() gave.
Result<std::vector<MaterialFrame>> framesFromWarp(const TriangleMesh& target, const Points3& warp);

/// Warp of every triangle in the target pose, unit: 3 x triangles.
Points3 warpOf(const TriangleMesh& target, const std::vector<MaterialFrame>& frames);

}  // namespace tenter
