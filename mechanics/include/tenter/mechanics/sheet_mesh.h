// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tenter/core/mesh.h"

namespace tenter {

/// How the quads of a grid are split.
enum class DiagonalPattern { kUniform, kAlternating };

/// Rows and columns of a grid sheet; node (i, j) has id j * u_lines.size() + i, at (u_lines[i],
/// v_lines[j]).
struct GridLines {
  std::vector<double> u_lines, v_lines;  ///< Increasing material coordinates [m].
  DiagonalPattern diagonals = DiagonalPattern::kUniform;
  int node(int i, int j) const { return j * static_cast<int>(u_lines.size()) + i; }
};

/// The mesh that a simulation runs on: rest shape, material directions, topology.
struct SheetMesh {
  TriangleMesh rest;  ///< Always with uv.
  MeshTopology topology;
  std::optional<GridLines> grid;
  std::string pattern;  ///< "grid 25x25 uniform", "mesh 1234 vertices": recorded with materials.

  /// Rest triangle in its own plane with the first axis along the weft: inverse of the 2 x 2 edge
  /// matrix, and area [m^2]. The metric is that of the rest positions; uv gives the direction only.
  struct RestTriangle {
    Mat2 edges_inverse;
    double area_m2;
  };
  std::vector<RestTriangle> triangles;

  int nodeCount() const { return rest.vertexCount(); }
  int triangleCount() const { return static_cast<int>(rest.triangles.size()); }
  double area() const;
};

/// Flat grid in the plane z = 0, x = u, y = v.
SheetMesh gridSheet(GridLines lines);
/// n x m equal intervals' nodes over [0, size]; counts are nodes.
SheetMesh gridSheet(const Vec2& size_m, int nodes_u, int nodes_v, DiagonalPattern diagonals);
/// `nodes` lines over [begin, end] (more only if the stops need them), through `stops` (clip and
/// table edges), evenly spaced between these; spacing stays within a factor of two of uniform where
/// the stops allow. Stops outside, or within 1e-6 of the length of an end or of another, are
/// dropped.
std::vector<double> linesThrough(double begin, double end, int nodes, std::vector<double> stops);
/// Flat rectangle with irregular triangles (jittered points, Delaunay), seeded; for tests of mesh
/// independence.
SheetMesh unstructuredSheet(const Vec2& size_m, double edge_m, std::uint64_t seed);
/// From a mesh file. Without uv a flat mesh takes its own x, y (after rotation into the plane); a
/// curved one without uv is an error unless `isotropic` (directions do not matter), when each
/// triangle gets any frame.
Result<SheetMesh> sheetFromMesh(const TriangleMesh& mesh, bool isotropic);

/// Green strains (E_uu, E_vv, 2 E_uv) of every triangle: 3 x triangles. `positions`: 3 x nodes [m].
Eigen::Matrix3Xd greenStrains(const SheetMesh& sheet, const Eigen::Ref<const Points3>& positions);

}  // namespace tenter
