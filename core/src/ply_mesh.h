// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "tenter/core/mesh_io.h"

namespace tenter {

/// ASCII and binary PLY of either byte order, in full double precision.
Result<MeshFile> parsePly(std::string_view content, const std::string& file);

}  // namespace tenter
