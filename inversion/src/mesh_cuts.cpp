// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh_cuts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <queue>
#include <utility>

namespace tenter {
namespace {

/// Which corner of a triangle a vertex is.
int cornerOf(const Triangle& t, int vertex) {
  return static_cast<int>(std::find(t.begin(), t.end(), vertex) - t.begin());
}

class Groups {
 public:
  explicit Groups(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(int a, int b) { parent_[find(a)] = find(b); }

 private:
  std::vector<int> parent_;
};

}  // namespace

CutMesh cutOpen(const TriangleMesh& mesh, const MeshTopology& topology,
                const std::vector<char>& cut) {
  // Corners of triangles at one vertex are the same one as long as no cut parts them.
  Groups groups(3 * mesh.triangles.size());
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    const MeshEdge& edge = topology.edges[e];
    if (edge.triangles[1] < 0 || cut[e] != 0) continue;
    for (const int v : edge.vertices) {
      const auto [a, b] = edge.triangles;
      groups.join(3 * a + cornerOf(mesh.triangles[a], v), 3 * b + cornerOf(mesh.triangles[b], v));
    }
  }
  CutMesh out;
  std::vector<int> id(3 * mesh.triangles.size(), -1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Triangle corners{};
    for (int k = 0; k < 3; ++k) {
      int& name = id[groups.find(static_cast<int>(3 * t) + k)];
      if (name < 0) {
        name = static_cast<int>(out.vertices.size());
        out.vertices.push_back(mesh.triangles[t][static_cast<std::size_t>(k)]);
      }
      corners[static_cast<std::size_t>(k)] = name;
    }
    out.triangles.push_back(corners);
  }
  return out;
}

std::vector<std::vector<int>> borderLoops(const std::vector<Triangle>& triangles,
                                          int vertex_count) {
  std::map<std::pair<int, int>, int> sides;
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
  std::vector<int> next(static_cast<std::size_t>(vertex_count), -1);
  for (const auto& [side, count] : sides)
    if (!sides.contains({side.second, side.first})) next[side.first] = side.second;
  std::vector<std::vector<int>> loops;
  for (int v = 0; v < vertex_count; ++v) {
    if (next[v] < 0) continue;
    std::vector<int> loop;
    for (int at = v; next[at] >= 0;) {
      loop.push_back(at);
      at = std::exchange(next[at], -1);
    }
    loops.push_back(std::move(loop));
  }
  return loops;
}

std::vector<int> shortestPath(const TriangleMesh& mesh, const MeshTopology& topology,
                              const std::vector<char>& from, const std::vector<char>& to) {
  const auto count = static_cast<std::size_t>(mesh.vertexCount());
  std::vector<std::vector<int>> at(count);
  for (std::size_t e = 0; e < topology.edges.size(); ++e)
    for (const int v : topology.edges[e].vertices) at[v].push_back(static_cast<int>(e));
  std::vector<double> distance(count, std::numeric_limits<double>::infinity());
  std::vector<int> came_by(count, -1);
  using Item = std::pair<double, int>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> open;
  for (std::size_t v = 0; v < count; ++v) {
    if (from[v] == 0) continue;
    distance[v] = 0.0;
    open.emplace(0.0, static_cast<int>(v));
  }
  while (!open.empty()) {
    const auto [length, v] = open.top();
    open.pop();
    if (length > distance[v]) continue;
    if (to[v] != 0) {
      std::vector<int> path;
      for (int walk = v; came_by[walk] >= 0;) {
        const auto& ends = topology.edges[came_by[walk]].vertices;
        path.push_back(came_by[walk]);
        walk = ends[0] == walk ? ends[1] : ends[0];
      }
      return path;
    }
    for (const int e : at[v]) {
      const auto& ends = topology.edges[e].vertices;
      const int other = ends[0] == v ? ends[1] : ends[0];
      const double to_other = length + (mesh.positions.col(other) - mesh.positions.col(v)).norm();
      if (!(to_other < distance[other])) continue;
      distance[other] = to_other;
      came_by[other] = e;
      open.emplace(to_other, other);
    }
  }
  return {};
}

Eigen::VectorXd angleDefects(const TriangleMesh& mesh, const MeshTopology& topology) {
  Eigen::VectorXd defect = Eigen::VectorXd::Constant(mesh.vertexCount(), 2.0 * std::numbers::pi);
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = mesh.positions.col(t[(k + 1) % 3]) - mesh.positions.col(t[k]);
      const Vec3 b = mesh.positions.col(t[(k + 2) % 3]) - mesh.positions.col(t[k]);
      defect[t[k]] -= std::atan2(a.cross(b).norm(), a.dot(b));
    }
  }
  for (const MeshEdge& e : topology.edges) {
    if (e.triangles[1] >= 0) continue;
    for (const int v : e.vertices) defect[v] = 0.0;
  }
  return defect;
}

}  // namespace tenter
