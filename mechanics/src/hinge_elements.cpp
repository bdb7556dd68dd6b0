// SPDX-License-Identifier: GPL-3.0-or-later
#include "hinge_elements.h"

#include <cmath>

#include "tenter/mechanics/dihedral_angle.h"

namespace tenter {
namespace {

/// A rest mesh with angles beyond this [rad] is curved, and the planar criterion below does not
/// speak of it.
constexpr double kFlatAngle_rad = 1e-6;
/// Of an edge's size; far above rounding, far below what moves a curvature by a measurable amount.
constexpr double kSymmetryTolerance = 1e-9;

bool isRigid(const std::vector<bool>& rigid, int triangle) {
  return !rigid.empty() && rigid[triangle];
}

Vec12 restPositions(const SheetMesh& sheet, const std::array<int, 4>& nodes) {
  Vec12 x;
  for (int i = 0; i < 4; ++i) x.segment<3>(3 * i) = sheet.rest.positions.col(nodes[i]);
  return x;
}

std::array<int, 4> hingeNodes(const MeshEdge& e) {
  return {e.vertices[0], e.vertices[1], e.opposite[0], e.opposite[1]};
}

/// Half angles are exact for every constant curvature just when the two triangles, unfolded, are
/// each other's image in the edge's midpoint (docs/mechanics-elements.md): apexes at (s, -h) and
/// (-s, h) about it.
bool halfAnglesAreExact(const SheetMesh& sheet, const MeshEdge& e) {
  const Vec12 x = restPositions(sheet, hingeNodes(e));
  const Vec3 edge = x.segment<3>(3) - x.segment<3>(0);
  const double length = edge.norm();
  const Vec3 along = edge / length;
  const Vec3 middle = 0.5 * (x.segment<3>(3) + x.segment<3>(0));
  double s[2], h[2];
  for (int side = 0; side < 2; ++side) {
    const Vec3 d = x.segment<3>(6 + 3 * side) - middle;
    s[side] = d.dot(along);
    h[side] = d.cross(along).norm();
  }
  return std::abs(s[0] + s[1]) + std::abs(h[0] - h[1]) <= kSymmetryTolerance * (length + h[0]);
}

bool isFlat(const SheetMesh& sheet) {
  for (const MeshEdge& e : sheet.topology.edges) {
    if (e.triangles[1] < 0) continue;
    const double angle = dihedralAngle(restPositions(sheet, hingeNodes(e)));
    if (std::abs(angle) > kFlatAngle_rad) return false;
  }
  return true;
}

class Builder {
 public:
  Builder(const SheetMesh& sheet, const std::vector<bool>& rigid, EdgeRotations rotations,
          int first_coordinate)
      : sheet_(sheet), rigid_(rigid), first_coordinate_(first_coordinate) {
    if (rotations == EdgeRotations::kAutomatic && !isFlat(sheet)) rotations = EdgeRotations::kAll;
    rotations_ = rotations;
  }

  HingeElements build() {
    const std::size_t n = sheet_.topology.edges.size();
    hinge_of_edge_.assign(n, -1);
    rotation_of_edge_.assign(n, -1);
    for (std::size_t e = 0; e < n; ++e) addEdge(static_cast<int>(e));
    for (int t = 0; t < sheet_.triangleCount(); ++t) {
      if (!isRigid(rigid_, t)) addTriangle(t);
    }
    return std::move(out_);
  }

 private:
  void addEdge(int id) {
    const MeshEdge& e = sheet_.topology.edges[id];
    const bool boundary = e.triangles[1] < 0;
    const bool rigid0 = isRigid(rigid_, e.triangles[0]);
    const bool rigid1 = boundary || isRigid(rigid_, e.triangles[1]);
    if (rigid0 && rigid1) return;
    if (!boundary) {
      hinge_of_edge_[id] = static_cast<int>(out_.edges.size());
      const std::array<int, 4> nodes = hingeNodes(e);
      out_.edges.push_back({nodes, dihedralAngle(restPositions(sheet_, nodes))});
    }
    const bool clamp_line = !boundary && (rigid0 || rigid1);
    if (!clamp_line && (boundary || needsRotation(e))) {
      rotation_of_edge_[id] = static_cast<int>(out_.rotation_edge.size());
      out_.rotation_edge.push_back(id);
    }
  }

  bool needsRotation(const MeshEdge& e) const {
    if (rotations_ == EdgeRotations::kAll) return true;
    return rotations_ == EdgeRotations::kAutomatic && !halfAnglesAreExact(sheet_, e);
  }

  void addTriangle(int t) {
    const Triangle& nodes = sheet_.rest.triangles[t];
    HingeTriangle element{t, sheet_.triangles[t].area_m2, {}};
    Stencil stencil;
    stencil.node_count = 3;
    for (int i = 0; i < 3; ++i) stencil.nodes[i] = nodes[i];
    for (int corner = 0; corner < 3; ++corner) {
      element.sides[corner] = makeSide(t, corner, &stencil);
    }
    out_.triangles.push_back(element);
    out_.stencils.push_back(stencil);
  }

  HingeSide makeSide(int t, int corner, Stencil* stencil) const {
    const int id = sheet_.topology.triangle_edges[t][corner];
    const MeshEdge& e = sheet_.topology.edges[id];
    const bool first = e.triangles[0] == t;
    const int other = e.triangles[first ? 1 : 0];
    HingeSide side;
    side.strain = strainOfUnitAngle(t, corner);
    side.edge = hinge_of_edge_[id];
    if (side.edge >= 0) {
      const bool clamp_line = isRigid(rigid_, other);
      side.angle_share = clamp_line ? 1.0 : 0.5;
      side.owner = first || clamp_line;
      const int a = (corner + 1) % 3, b = (corner + 2) % 3;
      const int flap = placeOf(e.opposite[first ? 1 : 0], stencil);
      side.local =
          first ? std::array<int, 4>{a, b, corner, flap} : std::array<int, 4>{b, a, flap, corner};
    }
    if (rotation_of_edge_[id] >= 0) {
      const double length =
          (sheet_.rest.positions.col(e.vertices[1]) - sheet_.rest.positions.col(e.vertices[0]))
              .norm();
      side.coordinate = first_coordinate_ + rotation_of_edge_[id];
      side.scalar = stencil->scalar_count;
      side.rotation_share = (first ? 1.0 : -1.0) / length;
      stencil->scalars[stencil->scalar_count++] = side.coordinate;
    }
    return side;
  }

  /// Around a vertex of three triangles two flaps are one node, which must not be listed twice.
  static int placeOf(int node, Stencil* stencil) {
    for (int i = 0; i < stencil->node_count; ++i) {
      if (stencil->nodes[i] == node) return i;
    }
    stencil->nodes[stencil->node_count] = node;
    return stencil->node_count++;
  }

  /// (l / A) (n_u^2, n_v^2, 2 n_u n_v): the inward gradient of the corner's shape function is n /
  /// height = n l / (2 A).
  Vec3 strainOfUnitAngle(int t, int corner) const {
    const SheetMesh::RestTriangle& rest = sheet_.triangles[t];
    const Vec2 g1 = rest.edges_inverse.row(0), g2 = rest.edges_inverse.row(1);
    const Vec2 gradient = corner == 0 ? Vec2(-g1 - g2) : (corner == 1 ? g1 : g2);
    const double slope = gradient.norm();  // 1 / height = l / (2 A)
    const Vec2 n = gradient / slope;
    return 2.0 * slope * Vec3(n[0] * n[0], n[1] * n[1], 2.0 * n[0] * n[1]);
  }

  const SheetMesh& sheet_;
  const std::vector<bool>& rigid_;
  EdgeRotations rotations_ = EdgeRotations::kAll;
  int first_coordinate_;
  std::vector<int> hinge_of_edge_, rotation_of_edge_;
  HingeElements out_;
};

}  // namespace

HingeElements buildHingeElements(const SheetMesh& sheet, const std::vector<bool>& rigid,
                                 EdgeRotations rotations, int first_coordinate) {
  return Builder(sheet, rigid, rotations, first_coordinate).build();
}

}  // namespace tenter
