// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/core/types.h"

namespace tenter {

/// For each point the ids of others near it, nearest first, at most `count`; all of them within
/// three cells of a square lattice that holds about two points a cell.
std::vector<std::vector<int>> neighbourLists(const std::vector<Vec2>& points, std::size_t count);

}  // namespace tenter
