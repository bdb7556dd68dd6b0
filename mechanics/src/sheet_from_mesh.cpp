// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Eigenvalues>
#include <cmath>
#include <string>
#include <utility>

#include "tenter/mechanics/sheet_mesh.h"

namespace tenter {
namespace {

/// Distance from the best plane, of the mesh's size, up to which a mesh is flat: single-precision
/// files are.
constexpr double kFlatness = 1e-5;
/// Area over squared longest edge under which a triangle gives no direction.
constexpr double kMinRelativeArea = 1e-9;

/// Best plane as a rotation whose rows are in-plane x, in-plane y and normal; the normal agrees
/// with the triangles'.
struct Plane {
  Mat3 rotation;
  Vec3 centre;
  double deviation;  ///< Largest distance from it [m].
  double size;       ///< Largest extent in it [m].
};

Vec3 areaNormal(const TriangleMesh& mesh) {
  Vec3 sum = Vec3::Zero();
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.positions.col(t[1]) - mesh.positions.col(t[0]);
    const Vec3 b = mesh.positions.col(t[2]) - mesh.positions.col(t[0]);
    sum += a.cross(b);
  }
  return sum;
}

Plane bestPlane(const TriangleMesh& mesh) {
  Plane plane;
  plane.centre = mesh.positions.rowwise().mean();
  const Points3 centred = mesh.positions.colwise() - plane.centre;
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(centred * centred.transpose());
  Vec3 normal = axes.eigenvectors().col(0);
  const Vec3 area_normal = areaNormal(mesh);
  if (normal.dot(area_normal) < 0.0) normal = -normal;
  // The smallest rotation into the plane: a mesh that lies in x, y keeps its own.
  plane.rotation = Eigen::Quaterniond::FromTwoVectors(normal, Vec3::UnitZ()).toRotationMatrix();
  const Points3 turned = plane.rotation * centred;
  plane.deviation = turned.row(2).cwiseAbs().maxCoeff();
  plane.size = (turned.rowwise().maxCoeff() - turned.rowwise().minCoeff()).norm();
  return plane;
}

std::string triangleName(int t) { return "triangle " + std::to_string(t); }

/// Edges (x1 - x0, x2 - x0) in the triangle's own orthonormal axes `first`, n x first.
SheetMesh::RestTriangle restTriangle(const Vec3& a, const Vec3& b, const Vec3& first,
                                     bool mirrored) {
  const Vec3 cross = a.cross(b);
  const Vec3 second = (mirrored ? -1.0 : 1.0) * cross.normalized().cross(first);
  Mat2 edges;
  edges << a.dot(first), b.dot(first), a.dot(second), b.dot(second);
  return {edges.inverse(), 0.5 * cross.norm()};
}

Result<SheetMesh::RestTriangle> makeRestTriangle(const TriangleMesh& mesh, int t,
                                                 bool any_direction) {
  const Triangle& nodes = mesh.triangles[t];
  const Vec3 a = mesh.positions.col(nodes[1]) - mesh.positions.col(nodes[0]);
  const Vec3 b = mesh.positions.col(nodes[2]) - mesh.positions.col(nodes[0]);
  const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (b - a).squaredNorm()});
  if (!(a.cross(b).norm() > kMinRelativeArea * longest)) {
    return badInput("", triangleName(t), "has no area", "remove slivers and merge its vertices");
  }
  if (any_direction) return restTriangle(a, b, a.normalized(), false);
  Mat2 uv_edges;
  uv_edges << mesh.uv.col(nodes[1]) - mesh.uv.col(nodes[0]),
      mesh.uv.col(nodes[2]) - mesh.uv.col(nodes[0]);
  const double determinant = uv_edges.determinant();
  if (!(std::abs(determinant) > kMinRelativeArea * uv_edges.squaredNorm())) {
    return badInput("", triangleName(t), "has no area in material coordinates",
                    "give every triangle its place in the flat fabric");
  }
  // dX/du, times the determinant's sign: (a, b) uv_edges^-1 e_u.
  const Vec2 first = uv_edges.inverse().col(0);
  const Vec3 weft = a * first[0] + b * first[1];
  return restTriangle(a, b, weft.normalized(), determinant < 0.0);
}

}  // namespace

Result<SheetMesh> sheetFromMesh(const TriangleMesh& mesh, bool isotropic) {
  Result<void> valid = validateMesh(mesh);
  if (!valid) return valid.error();
  Result<MeshTopology> topology = buildTopology(mesh);
  if (!topology) return topology.error();
  SheetMesh sheet;
  sheet.rest = mesh;
  sheet.topology = std::move(topology).value();
  sheet.pattern = "mesh " + std::to_string(mesh.vertexCount()) + " vertices";
  bool any_direction = false;
  if (!mesh.hasUv()) {
    const Plane plane = bestPlane(mesh);
    any_direction = plane.deviation > kFlatness * plane.size;
    if (any_direction && !isotropic) {
      return badInput("", "uv", "a curved mesh without material coordinates has no weft and warp",
                      "give uv in metres, or use a material that is the same in all directions");
    }
    sheet.rest.uv = (plane.rotation * (mesh.positions.colwise() - plane.centre)).topRows<2>();
    sheet.rest.uv.colwise() += (plane.rotation * plane.centre).head<2>();
  }
  for (int t = 0; t < sheet.triangleCount(); ++t) {
    Result<SheetMesh::RestTriangle> triangle = makeRestTriangle(sheet.rest, t, any_direction);
    if (!triangle) return triangle.error();
    sheet.triangles.push_back(*triangle);
  }
  return sheet;
}

}  // namespace tenter
