// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "tenter/core/mesh_io.h"

namespace tenter {

Result<MeshFile> parseObj(std::string_view content, const std::string& file);
std::string formatObj(const TriangleMesh& mesh);

}  // namespace tenter
