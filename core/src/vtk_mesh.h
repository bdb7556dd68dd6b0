// SPDX-License-Identifier: GPL-3.0-or-later
// The only place that sees VTK: VTP files to and from our mesh.
#pragma once

#include <string>

#include "tenter/core/mesh_io.h"

namespace tenter {

/// A mesh from the bytes of a VTP file; what VTK itself complains about becomes the reason.
Result<MeshFile> parseVtp(const std::string& content, const std::string& file);

/// The bytes of a VTP file: inline base64, zlib.
Result<std::string> formatVtp(const TriangleMesh& mesh, const MeshData& data);

}  // namespace tenter
