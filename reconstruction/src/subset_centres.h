// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "tenter/reconstruction/rest_surface.h"
#include "tenter/session/mounting.h"

namespace tenter {

/// The place nearest to `place` around which a square of this half side is free all over; nothing
/// within 2.5 half sides.
std::optional<Vec2> freeSquare(const Vec2& place, double half_m,
                               const std::function<bool(const Vec2&)>& free);

/// Moves the subsets by which vertices are followed to where no clip will hide cloth from their
/// view; sightings for which there is no such place are dropped, and so are those of vertices that
/// a clip holds. Clips hide as they stand at rest: they and the cloth beside them move together.
/// @param on_cloth  whether a place of the sheet's plane is cloth.
void avoidClips(const std::vector<CameraView>& views, const std::vector<MountedClip>& clips,
                int subset_px, const std::function<bool(const Vec2&)>& on_cloth,
                RestSurface& surface);

/// Whether a convex polygon holds a place, its border included.
bool holds(const std::vector<Vec2>& outline, const Vec2& place);

}  // namespace tenter
