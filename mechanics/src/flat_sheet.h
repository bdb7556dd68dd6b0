// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tenter/mechanics/sheet_mesh.h"

namespace tenter {

/// Sheet in the plane z = 0 whose rest positions are its material coordinates. Precondition:
/// counter-clockwise, valid topology.
SheetMesh flatSheet(const Points2& uv, std::vector<Triangle> triangles, std::string pattern);

}  // namespace tenter
