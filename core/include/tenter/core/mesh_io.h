// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tenter/core/mesh.h"

namespace tenter {

/// Named per-vertex or per-triangle data of a VTP file; one column an item.
struct MeshData {
  std::map<std::string, Eigen::MatrixXd> point;
  std::map<std::string, Eigen::MatrixXd> cell;
};

struct MeshFile {
  TriangleMesh mesh;
  MeshData data;
};

/// Reads OBJ, PLY or VTP by extension [m]. Vertex ids are the file's own order. Polygons are split
/// as fans. Material coordinates: `uv` point data in VTP; `s`,`t` or `u`,`v` in PLY; `vt` in OBJ,
/// scaled by nothing. Error kBadInput with file, line or element and reason. Validation of the mesh
/// itself is the caller's (validateMesh).
Result<MeshFile> readMesh(const std::filesystem::path& file);

/// Writes VTP (binary, zlib), atomically: the file is complete or absent.
Result<void> writeVtp(const std::filesystem::path& file, const TriangleMesh& mesh,
                      const MeshData& data = {});

/// Writes OBJ with `vt` if there are material coordinates.
Result<void> writeObj(const std::filesystem::path& file, const TriangleMesh& mesh);

/// A ParaView collection of time steps [s] and file names relative to `file`.
Result<void> writePvd(const std::filesystem::path& file,
                      const std::vector<std::pair<double, std::string>>& steps);

}  // namespace tenter
