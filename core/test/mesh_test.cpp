// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "measurement_samples.h"

namespace tenter {
namespace {

using testing::HasSubstr;

TEST(TopologyTest, OfASquareSheetObeysEuler) {
  constexpr int kNodes = 5;
  const TriangleMesh mesh = samples::squareSheet(kNodes);
  const auto topology = buildTopology(mesh);
  ASSERT_TRUE(topology.ok());
  const auto edges = static_cast<int>(topology->edges.size());
  EXPECT_EQ(mesh.vertexCount() - edges + static_cast<int>(mesh.triangles.size()), 1);
  int boundary = 0;
  for (const MeshEdge& edge : topology->edges) boundary += edge.triangles[1] < 0 ? 1 : 0;
  EXPECT_EQ(boundary, 4 * (kNodes - 1));
}

TEST(TopologyTest, EdgesLieOppositeTheirCorners) {
  const TriangleMesh mesh = samples::squareSheet(3);
  const auto topology = buildTopology(mesh);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto id = static_cast<std::size_t>(topology->triangle_edges[t][corner]);
      const MeshEdge& edge = topology->edges[id];
      const std::size_t side = edge.triangles[0] == static_cast<int>(t) ? 0 : 1;
      ASSERT_EQ(edge.triangles[side], static_cast<int>(t));
      EXPECT_EQ(edge.opposite[side], mesh.triangles[t][corner]);
      // Triangle 0 runs along the edge as stored, triangle 1 against it.
      EXPECT_EQ(edge.vertices[side], mesh.triangles[t][(corner + 1) % 3]);
    }
  }
}

struct BrokenMesh {
  const char* name;
  std::function<void(TriangleMesh&)> damage;
  const char* place;
  const char* reason;
};

class BrokenMeshTest : public testing::TestWithParam<BrokenMesh> {};

TEST_P(BrokenMeshTest, IsRefused) {
  TriangleMesh mesh = samples::squareSheet(3);
  ASSERT_TRUE(validateMesh(mesh).ok());
  GetParam().damage(mesh);
  const auto done = validateMesh(mesh);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().place, GetParam().place);
  EXPECT_THAT(done.error().reason, HasSubstr(GetParam().reason));
}

void append(TriangleMesh& mesh, const TriangleMesh& other, const Vec3& shift) {
  const int count = mesh.vertexCount();
  mesh.positions.conservativeResize(3, count + other.vertexCount());
  mesh.positions.rightCols(other.vertexCount()) = other.positions.colwise() + shift;
  mesh.uv.resize(2, 0);
  for (const Triangle& t : other.triangles) {
    mesh.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, BrokenMeshTest,
    testing::Values(
        BrokenMesh{"nan", [](TriangleMesh& m) { m.positions(1, 4) = std::nan(""); }, "vertex 4",
                   "not finite"},
        BrokenMesh{"infinite_uv",
                   [](TriangleMesh& m) { m.uv(1, 2) = std::numeric_limits<double>::infinity(); },
                   "vertex 2", "material coordinate"},
        BrokenMesh{"short_uv", [](TriangleMesh& m) { m.uv.conservativeResize(2, 4); }, "uv",
                   "4 entries for 9"},
        BrokenMesh{"id_too_large", [](TriangleMesh& m) { m.triangles[2][1] = 9; }, "triangle 2",
                   "names vertex 9"},
        BrokenMesh{"id_negative", [](TriangleMesh& m) { m.triangles[2][1] = -1; }, "triangle 2",
                   "names vertex -1"},
        BrokenMesh{"vertex_twice", [](TriangleMesh& m) { m.triangles[3][1] = m.triangles[3][0]; },
                   "triangle 3", "a vertex twice"},
        BrokenMesh{"flipped",
                   [](TriangleMesh& m) { std::swap(m.triangles[1][0], m.triangles[1][1]); },
                   "triangle 1", "other way round"},
        BrokenMesh{"three_on_an_edge",
                   [](TriangleMesh& m) {
                     m.positions.conservativeResize(3, 10);
                     m.positions.col(9) = Vec3(0.02, 0.03, 0.05);
                     m.uv.resize(2, 0);
                     m.triangles.push_back({0, 4, 9});
                   },
                   "triangle 8", "third at edge"},
        BrokenMesh{"no_area",
                   [](TriangleMesh& m) { m.positions.col(1) = 0.5 * m.positions.col(4); },
                   "triangle 0", "no area"},
        BrokenMesh{"loose_vertex",
                   [](TriangleMesh& m) {
                     m.positions.conservativeResize(3, 10);
                     m.positions.col(9) = Vec3(1, 1, 1);
                     m.uv.resize(2, 0);
                   },
                   "vertex 9", "in no triangle"},
        BrokenMesh{"copy_in_place",
                   [](TriangleMesh& m) { append(m, samples::squareSheet(3), Vec3::Zero()); },
                   "vertex 9", "exactly where vertex 0"},
        BrokenMesh{"two_pieces",
                   [](TriangleMesh& m) { append(m, samples::squareSheet(3), Vec3(1, 0, 0)); },
                   "vertex 9", "not connected"},
        BrokenMesh{"no_triangles", [](TriangleMesh& m) { m.triangles.clear(); }, "",
                   "no triangles"},
        BrokenMesh{"no_vertices", [](TriangleMesh& m) { m = TriangleMesh(); }, "",
                   "fewer than three"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace tenter
