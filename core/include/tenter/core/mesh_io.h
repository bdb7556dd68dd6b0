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

/// Reads OBJ, PLY or VTP by extension [m]. Vertex ids are the file's own order; polygons become
/// fans. Material coordinates [m]: `uv` point data in VTP; `u`,`v` or `s`,`t` in PLY; `vt` in OBJ.
/// An OBJ with a seam (two `vt` on one vertex, or a vertex without one) yields a mesh without uv.
/// Error kBadInput with file, line or element and reason. validateMesh is the caller's.
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
