// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/core/types.h"

namespace tenter {

using Triangle = std::array<int, 3>;

/// A triangle mesh with optional material coordinates.
struct TriangleMesh {
  Points3 positions;                ///< 3 x n [m].
  std::vector<Triangle> triangles;  ///< Vertex ids from 0, all turning the same way round.
  Points2 uv;  ///< 2 x n material coordinates [m], u = weft, v = warp; 2 x 0 if there are none.

  int vertexCount() const { return static_cast<int>(positions.cols()); }
  bool hasUv() const { return uv.cols() == positions.cols() && uv.cols() > 0; }
};

/// One edge with the triangles on its sides; `triangles[1]` and `opposite[1]` are -1 on the
/// boundary.
struct MeshEdge {
  std::array<int, 2> vertices;   ///< As triangle 0 runs along it.
  std::array<int, 2> triangles;  ///< Triangle ids.
  std::array<int, 2> opposite;   ///< Vertex of each triangle that is not on the edge.
};

struct MeshTopology {
  std::vector<MeshEdge> edges;
  std::vector<std::array<int, 3>>
      triangle_edges;  ///< Edge opposite to corner 0, 1, 2 of each triangle.
};

/// Edges and adjacency. Error, naming the triangle: ids out of range, a vertex twice in a triangle,
/// an edge with three triangles, neighbours turning opposite ways.
Result<MeshTopology> buildTopology(const TriangleMesh& mesh);

/// What every reader demands: finite coordinates, valid topology, no zero-area triangle, no vertex
/// at another's place that shares no triangle with it only by duplication, one connected piece,
/// every vertex in a triangle.
Result<void> validateMesh(const TriangleMesh& mesh);

}  // namespace tenter
