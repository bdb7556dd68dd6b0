// SPDX-License-Identifier: GPL-3.0-or-later
#include <vtkCellArray.h>
#include <vtkCellLocator.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "analytic_obstacles.h"
#include "tenter/core/mesh_io.h"

namespace tenter {
namespace {

constexpr double kMinRelativeArea = 1e-9;
/// Barycentric coordinate below which the nearest point lies on the border of its triangle.
constexpr double kOnBorder = 1e-9;

/// Sign and normal of the nearest point are those of the feature that it lies on: a face, an edge
/// (sum of its faces), or a vertex (sum of its faces, weighted by angle) [Baerentzen05].
class MeshObstacle final : public Obstacle {
 public:
  MeshObstacle(const TriangleMesh& mesh, MeshTopology topology)
      : mesh_(mesh), topology_(std::move(topology)) {
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    for (int v = 0; v < mesh.vertexCount(); ++v)
      points->InsertNextPoint(mesh.positions.col(v).data());
    vtkNew<vtkCellArray> cells;
    vertex_normals_ = Points3::Zero(3, mesh.vertexCount());
    face_normals_.resize(3, static_cast<Eigen::Index>(mesh.triangles.size()));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Triangle& ids = mesh.triangles[t];
      cells->InsertNextCell({ids[0], ids[1], ids[2]});
      const Vec3 a = mesh.positions.col(ids[1]) - mesh.positions.col(ids[0]);
      const Vec3 b = mesh.positions.col(ids[2]) - mesh.positions.col(ids[0]);
      const Vec3 normal = a.cross(b).normalized();
      face_normals_.col(static_cast<Eigen::Index>(t)) = normal;
      for (int i = 0; i < 3; ++i) {
        const Vec3 p = mesh.positions.col(ids[(i + 1) % 3]) - mesh.positions.col(ids[i]);
        const Vec3 q = mesh.positions.col(ids[(i + 2) % 3]) - mesh.positions.col(ids[i]);
        vertex_normals_.col(ids[i]) += std::atan2(p.cross(q).norm(), p.dot(q)) * normal;
      }
    }
    surface_->SetPoints(points);
    surface_->SetPolys(cells);
    locator_->SetDataSet(surface_);
    locator_->BuildLocator();
  }

  Nearest nearest(const Vec3& place) const override {
    Nearest out;
    vtkIdType cell = -1;
    int sub = 0;
    double squared = 0.0;
    locator_->FindClosestPoint(place.data(), out.point.data(), scratch_, cell, sub, squared);
    out.normal = featureNormal(static_cast<int>(cell), out.point);
    const double side = out.normal.dot(place - out.point);
    out.distance_m = side < 0.0 ? -std::sqrt(squared) : std::sqrt(squared);
    return out;
  }

 private:
  Vec3 featureNormal(int t, const Vec3& point) const {
    const Triangle& ids = mesh_.triangles[t];
    const Vec3 face = face_normals_.col(t);
    std::array<bool, 3> zero{};
    int zeros = 0;
    for (int i = 0; i < 3; ++i) {
      const Vec3 p = mesh_.positions.col(ids[(i + 1) % 3]),
                 q = mesh_.positions.col(ids[(i + 2) % 3]);
      const Vec3 r = mesh_.positions.col(ids[i]);
      const double share = (q - p).cross(point - p).dot(face) / (q - p).cross(r - p).dot(face);
      zero[i] = share < kOnBorder;
      zeros += zero[i] ? 1 : 0;
    }
    if (zeros == 1) {
      const int corner = zero[0] ? 0 : (zero[1] ? 1 : 2);
      const MeshEdge& e = topology_.edges[topology_.triangle_edges[t][corner]];
      if (e.triangles[1] < 0) return face;
      const Vec3 sum = face_normals_.col(e.triangles[0]) + face_normals_.col(e.triangles[1]);
      return sum.norm() > 0.0 ? Vec3(sum.normalized()) : face;
    }
    if (zeros == 2) {
      const int corner = !zero[0] ? 0 : (!zero[1] ? 1 : 2);
      const Vec3 sum = vertex_normals_.col(ids[corner]);
      return sum.norm() > 0.0 ? Vec3(sum.normalized()) : face;
    }
    return face;
  }

  TriangleMesh mesh_;
  MeshTopology topology_;
  Points3 face_normals_, vertex_normals_;
  vtkNew<vtkPolyData> surface_;
  vtkNew<vtkCellLocator> locator_;
  mutable vtkNew<vtkGenericCell> scratch_;
};

Result<void> checkSurface(const TriangleMesh& mesh, const MeshTopology& topology) {
  if (mesh.triangles.empty()) return badInput("", "", "the obstacle has no triangles");
  double volume = 0.0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& ids = mesh.triangles[t];
    const Vec3 p = mesh.positions.col(ids[0]), q = mesh.positions.col(ids[1]),
               r = mesh.positions.col(ids[2]);
    if (!p.allFinite() || !q.allFinite() || !r.allFinite()) {
      return badInput("", "triangle " + std::to_string(t), "has a coordinate that is not finite");
    }
    const double longest =
        std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()});
    if (!((q - p).cross(r - p).norm() > kMinRelativeArea * longest)) {
      return badInput("", "triangle " + std::to_string(t), "has no area", "remove slivers");
    }
    volume += p.dot(q.cross(r)) / 6.0;
  }
  const bool closed = std::none_of(topology.edges.begin(), topology.edges.end(),
                                   [](const MeshEdge& e) { return e.triangles[1] < 0; });
  if (closed && volume < 0.0) {
    return badInput("", "", "the obstacle is closed and its triangles turn inwards",
                    "flip their orientation");
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<Obstacle>> makeMeshObstacle(const TriangleMesh& mesh) {
  auto topology = buildTopology(mesh);
  if (!topology) return topology.error();
  if (auto good = checkSurface(mesh, *topology); !good) return good.error();
  return std::unique_ptr<Obstacle>(
      std::make_unique<MeshObstacle>(mesh, std::move(topology).value()));
}

Result<std::unique_ptr<Obstacle>> makeObstacle(const std::string& description) {
  auto analytic = makeAnalyticObstacle(description);
  if (!analytic.ok() || *analytic != nullptr) return analytic;
  const auto file = readMesh(description);
  if (!file) return file.error();
  auto obstacle = makeMeshObstacle(file->mesh);
  if (!obstacle) return obstacle.error().in(description);
  return obstacle;
}

}  // namespace tenter
