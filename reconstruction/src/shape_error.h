// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sheet_heights.h"

namespace tenter {

/// How a surface at rest was found: what its heights err by follows from that.
struct SurfacePasses {
  int order = 2;            ///< Of the first matches' warps.
  double half_cells = 0.0;  ///< Half a subset's side over the nodes' spacing.
  int reach = 0;            ///< Nodes each way over which heights are smoothed between passes.
  int passes = 0;           ///< Over the surface; they change vertices that are `warped`.
};

/// Adds to the covariances of valid vertices what the surface's own shape does to their heights:
/// the noise that comes in through the surface which the views were laid over, what passes make of
/// the surface found, and how far first matches err beyond their noise, which those that were
/// matched again show.
/// @param first  Heights by the first matches.
/// @param last   Heights by the last ones.
void addShapeErrors(const std::vector<CameraView>& views, const SheetGrid& grid,
                    const SheetHeights& first, const SheetHeights& last,
                    const SurfacePasses& passes, RestSurface& surface);

}  // namespace tenter
