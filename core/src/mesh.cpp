// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <unordered_map>

namespace tenter {

namespace {

/// Area over the squared longest edge below which a triangle has no direction: far under any usable
/// mesh (an equilateral triangle has 0.43) and far above rounding of float coordinates.
constexpr double kMinRelativeArea = 1e-6;

std::string triangleName(std::size_t t) { return "triangle " + std::to_string(t); }
std::string vertexName(int v) { return "vertex " + std::to_string(v); }

std::uint64_t edgeKey(int a, int b) {
  const auto [low, high] = std::minmax(a, b);
  return (static_cast<std::uint64_t>(low) << 32U) | static_cast<std::uint32_t>(high);
}

Result<void> checkIds(const TriangleMesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& triangle = mesh.triangles[t];
    for (const int v : triangle) {
      if (v < 0 || v >= mesh.vertexCount()) {
        return badInput("", triangleName(t),
                        "names vertex " + std::to_string(v) + " of a mesh with " +
                            std::to_string(mesh.vertexCount()) + " vertices");
      }
    }
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) {
      return badInput("", triangleName(t), "has a vertex twice");
    }
  }
  return {};
}

/// Adds the second triangle of an edge that is already known.
Result<void> closeEdge(MeshEdge& edge, int from, std::size_t t, int opposite) {
  const std::string name =
      "edge " + std::to_string(edge.vertices[0]) + "-" + std::to_string(edge.vertices[1]);
  if (edge.triangles[1] >= 0) {
    return badInput("", triangleName(t), "is the third at " + name,
                    "cloth is a single sheet: remove the extra triangles");
  }
  if (edge.vertices[0] == from) {
    return badInput("", triangleName(t),
                    "turns the other way round than triangle " + std::to_string(edge.triangles[0]) +
                        " at " + name,
                    "orient all triangles alike");
  }
  edge.triangles[1] = static_cast<int>(t);
  edge.opposite[1] = opposite;
  return {};
}

Result<void> checkCoordinates(const TriangleMesh& mesh) {
  if (mesh.vertexCount() < 3) return badInput("", "", "the mesh has fewer than three vertices");
  if (mesh.triangles.empty()) return badInput("", "", "the mesh has no triangles");
  if (mesh.uv.cols() != 0 && mesh.uv.cols() != mesh.positions.cols()) {
    return badInput("", "uv",
                    "has " + std::to_string(mesh.uv.cols()) + " entries for " +
                        std::to_string(mesh.vertexCount()) + " vertices");
  }
  for (int v = 0; v < mesh.vertexCount(); ++v) {
    if (!mesh.positions.col(v).allFinite()) {
      return badInput("", vertexName(v), "has a coordinate that is not finite");
    }
    if (mesh.hasUv() && !mesh.uv.col(v).allFinite()) {
      return badInput("", vertexName(v), "has a material coordinate that is not finite");
    }
  }
  return {};
}

Result<void> checkAreas(const TriangleMesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& triangle = mesh.triangles[t];
    const Vec3 a = mesh.positions.col(triangle[1]) - mesh.positions.col(triangle[0]);
    const Vec3 b = mesh.positions.col(triangle[2]) - mesh.positions.col(triangle[0]);
    const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (a - b).squaredNorm()});
    if (!(a.cross(b).norm() > 2.0 * kMinRelativeArea * longest)) {
      return badInput("", triangleName(t), "has no area", "remove slivers and merge its vertices");
    }
  }
  return {};
}

Result<void> checkEveryVertexUsed(const TriangleMesh& mesh) {
  std::vector<char> used(static_cast<std::size_t>(mesh.vertexCount()), 0);
  for (const Triangle& triangle : mesh.triangles) {
    for (const int v : triangle) used[static_cast<std::size_t>(v)] = 1;
  }
  const auto unused = std::find(used.begin(), used.end(), 0);
  if (unused == used.end()) return {};
  return badInput("", vertexName(static_cast<int>(unused - used.begin())), "is in no triangle",
                  "remove loose vertices");
}

/// Two vertices at exactly one place are a seam that was never welded, or a copy.
Result<void> checkDuplicates(const TriangleMesh& mesh) {
  std::vector<int> order(static_cast<std::size_t>(mesh.vertexCount()));
  std::iota(order.begin(), order.end(), 0);
  const auto before = [&mesh](int a, int b) {
    for (int axis = 0; axis < 3; ++axis) {
      const double difference = mesh.positions(axis, a) - mesh.positions(axis, b);
      if (difference != 0.0) return difference < 0.0;
    }
    return a < b;
  };
  std::sort(order.begin(), order.end(), before);
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (mesh.positions.col(order[i]) == mesh.positions.col(order[i - 1])) {
      return badInput("", vertexName(order[i]),
                      "lies exactly where vertex " + std::to_string(order[i - 1]) + " lies",
                      "merge duplicate vertices");
    }
  }
  return {};
}

int rootOf(std::vector<int>& parent, int v) {
  const auto at = [&parent](int i) -> int& { return parent[static_cast<std::size_t>(i)]; };
  while (at(v) != v) {
    at(v) = at(at(v));
    v = at(v);
  }
  return v;
}

Result<void> checkConnected(const TriangleMesh& mesh) {
  std::vector<int> parent(static_cast<std::size_t>(mesh.vertexCount()));
  std::iota(parent.begin(), parent.end(), 0);
  for (const Triangle& triangle : mesh.triangles) {
    const int root = rootOf(parent, triangle[0]);
    parent[static_cast<std::size_t>(rootOf(parent, triangle[1]))] = root;
    parent[static_cast<std::size_t>(rootOf(parent, triangle[2]))] = root;
  }
  const int first = rootOf(parent, 0);
  for (int v = 1; v < mesh.vertexCount(); ++v) {
    if (rootOf(parent, v) != first) {
      return badInput("", vertexName(v), "is not connected with vertex 0",
                      "the mesh must be one piece");
    }
  }
  return {};
}

}  // namespace

Result<MeshTopology> buildTopology(const TriangleMesh& mesh) {
  if (auto done = checkIds(mesh); !done) return done.error();
  MeshTopology topology;
  topology.triangle_edges.resize(mesh.triangles.size());
  std::unordered_map<std::uint64_t, int> edge_ids;
  edge_ids.reserve(2 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const int opposite = mesh.triangles[t][corner];
      const int from = mesh.triangles[t][(corner + 1) % 3];
      const int to = mesh.triangles[t][(corner + 2) % 3];
      const auto [entry, is_new] =
          edge_ids.try_emplace(edgeKey(from, to), static_cast<int>(topology.edges.size()));
      topology.triangle_edges[t][corner] = entry->second;
      if (is_new) {
        topology.edges.push_back({{from, to}, {static_cast<int>(t), -1}, {opposite, -1}});
        continue;
      }
      MeshEdge& edge = topology.edges[static_cast<std::size_t>(entry->second)];
      if (auto done = closeEdge(edge, from, t, opposite); !done) return done.error();
    }
  }
  return topology;
}

Result<void> validateMesh(const TriangleMesh& mesh) {
  if (auto done = checkCoordinates(mesh); !done) return done;
  if (auto topology = buildTopology(mesh); !topology) return topology.error();
  if (auto done = checkAreas(mesh); !done) return done;
  if (auto done = checkEveryVertexUsed(mesh); !done) return done;
  if (auto done = checkDuplicates(mesh); !done) return done;
  return checkConnected(mesh);
}

}  // namespace tenter
