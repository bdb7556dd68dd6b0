// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/core/mesh.h"

namespace tenter {

/// A mesh whose vertices are opened along cut edges.
struct CutMesh {
  std::vector<Triangle> triangles;  ///< Of corners, in the order of the mesh.
  std::vector<int> vertices;        ///< Of the mesh, one a corner.
};
CutMesh cutOpen(const TriangleMesh& mesh, const MeshTopology& topology,
                const std::vector<char>& cut);

/// Closed walks along border edges, each vertex once.
std::vector<std::vector<int>> borderLoops(const std::vector<Triangle>& triangles, int vertex_count);

/// Edges of a shortest path from any vertex of `from` to any of `to`, both marked one a vertex;
/// empty if there is none.
std::vector<int> shortestPath(const TriangleMesh& mesh, const MeshTopology& topology,
                              const std::vector<char>& from, const std::vector<char>& to);

/// 2 pi minus the sum of angles at each vertex; 0 on the border.
Eigen::VectorXd angleDefects(const TriangleMesh& mesh, const MeshTopology& topology);

}  // namespace tenter
