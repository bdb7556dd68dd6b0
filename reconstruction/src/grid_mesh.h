// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "sheet_heights.h"

namespace tenter {

/// The mesh of the largest connected part of a grid whose nodes were matched; holes of single nodes
/// are closed by what the nodes around them say. A grid that goes to the edge of its cloth is kept
/// whole. Error if nothing is left.
Result<RestSurface> meshOnGrid(const SheetGrid& grid, const SheetHeights& heights,
                               std::vector<RestVertex> vertices);

}  // namespace tenter
