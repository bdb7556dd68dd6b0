// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/inverse_shell.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "rest_elements.h"

namespace tenter {
namespace {

/// Area over squared edges under which a triangle's material coordinates give no direction.
constexpr double kMinRelativeArea = 1e-9;

bool hasRotations(const ClothModel& model) { return model.bending == BendingElement::kHinge; }

Result<std::vector<MaterialFrame>> framesFromUv(const TriangleMesh& mesh) {
  std::vector<MaterialFrame> frames;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& ids = mesh.triangles[t];
    MaterialFrame frame;
    frame << mesh.uv.col(ids[1]) - mesh.uv.col(ids[0]), mesh.uv.col(ids[2]) - mesh.uv.col(ids[0]);
    if (!(std::abs(frame.determinant()) > kMinRelativeArea * frame.squaredNorm())) {
      return badInput("", "triangle " + std::to_string(t), "has no area in material coordinates",
                      "give every triangle its place in the flat fabric");
    }
    frames.push_back(frame);
  }
  return frames;
}

ClothTerms termsOf(const ClothLaws& laws, const SheetMesh& sheet, const ElementRest& rest) {
  ClothTerms out;
  out.terms.push_back(makeEdgeTerm(sheet, laws.membrane, rest));
  if (laws.bending) out.terms.push_back(makeRawHingeTerm(sheet, laws.bending, rest));
  return out;
}

/// Visits every element's gradient and, if wanted, its derivative: force(row, value) and
/// block(row, column, value) in an order that depends on the mesh alone.
template <class Force, class Block>
class Elements {
 public:
  Elements(const InverseShell& shell, const std::vector<MaterialFrame>& frames,
           const Eigen::VectorXd& q, const Points3& rest, Force force, Block block)
      : shell_(shell), frames_(frames), q_(q), rest_(rest), force_(force), block_(block) {}

  void visit() {
    const ClothModel& model = *shell_.material().model;
    model.membrane == MembraneElement::kEdges ? visitEdges() : visitMembranes();
    if (shell_.material().laws.bending) {
      model.bending == BendingElement::kRawHinge ? visitHinges() : visitBentTriangles();
    }
    visitWeights();
  }

 private:
  Vec3 x(int v) const { return q_.segment<3>(3 * v); }
  Vec3 r(int v) const { return rest_.col(v); }

  template <class Matrix>
  void emit(int row_vertex, int column_vertex, const Matrix& m) {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) block_(3 * row_vertex + a, 3 * column_vertex + b, m(a, b));
  }
  template <class Vector>
  void emitForce(int vertex, const Vector& f) {
    for (int a = 0; a < 3; ++a) force_(3 * vertex + a, f[a]);
  }

  void visitEdges() {
    const auto& edges = shell_.topology().edges;
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto [i, j] = edges[e].vertices;
      const EdgeGradient g = edgeGradient(*shell_.material().laws.membrane, static_cast<int>(e),
                                          {x(i), x(j)}, {r(i), r(j)});
      emitForce(j, g.force);
      emitForce(i, -g.force);
      emit(j, j, g.block);
      emit(i, i, g.block);
      emit(i, j, -g.block);
      emit(j, i, -g.block);
    }
  }

  void visitHinges() {
    int element = 0;
    for (const MeshEdge& e : shell_.topology().edges) {
      if (e.triangles[1] < 0) continue;
      const std::array<int, 4> ids{e.vertices[0], e.vertices[1], e.opposite[0], e.opposite[1]};
      Vec12 pose, rest;
      for (int i = 0; i < 4; ++i) {
        pose.segment<3>(3 * i) = x(ids[i]);
        rest.segment<3>(3 * i) = r(ids[i]);
      }
      const RawHingeGradient g =
          rawHingeGradient(*shell_.material().laws.bending, element++, pose, rest);
      for (int i = 0; i < 4; ++i) {
        emitForce(ids[i], g.force.segment<3>(3 * i));
        for (int j = 0; j < 4; ++j) emit(ids[i], ids[j], g.block.block<3, 3>(3 * i, 3 * j));
      }
    }
  }

  void visitMembranes() {
    for (std::size_t t = 0; t < shell_.target().triangles.size(); ++t) {
      const Triangle& ids = shell_.target().triangles[t];
      const MembraneGradient g = membraneGradient(
          *shell_.material().laws.membrane, static_cast<int>(t), shell_.material().model->membrane,
          frames_[t], {x(ids[0]), x(ids[1]), x(ids[2])}, {r(ids[0]), r(ids[1]), r(ids[2])});
      for (int i = 0; i < 3; ++i) {
        emitForce(ids[i], g.force.segment<3>(3 * i));
        for (int j = 0; j < 3; ++j) emit(ids[i], ids[j], g.block.block<3, 3>(3 * i, 3 * j));
      }
    }
  }

  void visitBentTriangles() {
    const MeshTopology& topology = shell_.topology();
    const int first_rotation = 3 * shell_.vertexCount();
    for (std::size_t t = 0; t < shell_.target().triangles.size(); ++t) {
      const Triangle& corners = shell_.target().triangles[t];
      std::array<int, 6> ids{corners[0], corners[1], corners[2]};
      std::array<int, 3> rotation{};
      BentTriangle bent;
      bent.frame = frames_[t];
      for (int s = 0; s < 3; ++s) {
        const int edge = topology.triangle_edges[t][s];
        const MeshEdge& e = topology.edges[edge];
        BentSide& side = bent.sides[s];
        side.first = e.triangles[0] == static_cast<int>(t);
        side.hinge = e.triangles[1] >= 0;
        rotation[s] = first_rotation + edge;
        side.rotation = q_[rotation[s]];
        const auto local = [&](int vertex) {
          for (int i = 0; i < bent.node_count; ++i)
            if (ids[i] == vertex) return i;
          ids[bent.node_count] = vertex;
          return bent.node_count++;
        };
        side.begin = local(e.vertices[0]);
        side.end = local(e.vertices[1]);
        if (side.hinge)
          side.hinge_nodes = {side.begin, side.end, local(e.opposite[0]), local(e.opposite[1])};
      }
      for (int i = 0; i < bent.node_count; ++i) {
        bent.x[i] = x(ids[i]);
        bent.rest[i] = r(ids[i]);
      }
      const BentGradient g =
          bentGradient(*shell_.material().laws.bending, static_cast<int>(t), bent);
      for (int i = 0; i < bent.node_count; ++i) {
        emitForce(ids[i], g.force.segment<3>(3 * i));
        for (int j = 0; j < bent.node_count; ++j)
          emit(ids[i], ids[j], g.block.block<3, 3>(3 * i, 3 * j));
        for (int a = 0; a < 3; ++a)
          for (int s = 0; s < 3; ++s) {
            block_(3 * ids[i] + a, rotation[s], g.block(3 * i + a, 18 + s));
            block_(rotation[s], 3 * ids[i] + a, g.block(18 + s, 3 * i + a));
          }
      }
      for (int s = 0; s < 3; ++s) {
        force_(rotation[s], g.force[18 + s]);
        for (int u = 0; u < 3; ++u) block_(rotation[s], rotation[u], g.block(18 + s, 18 + u));
      }
    }
  }

  void visitWeights() {
    for (const Triangle& ids : shell_.target().triangles) {
      const WeightGradient g =
          weightGradient(shell_.material().areal_density_kg_per_m2,
                         shell_.material().gravity_m_per_s2, {r(ids[0]), r(ids[1]), r(ids[2])});
      for (int i = 0; i < 3; ++i) {
        emitForce(ids[i], g.force);
        for (int j = 0; j < 3; ++j) emit(ids[i], ids[j], g.blocks[j]);
      }
    }
  }

  const InverseShell& shell_;
  const std::vector<MaterialFrame>& frames_;
  const Eigen::VectorXd& q_;
  const Points3& rest_;
  Force force_;
  Block block_;
};

}  // namespace

Result<InverseShell> InverseShell::create(const TriangleMesh& target, ShellMaterial material,
                                          std::vector<MaterialFrame> frames) {
  require(material.model != nullptr && material.laws.membrane, "InverseShell: no material");
  require(frames.empty() || frames.size() == target.triangles.size(),
          "InverseShell: one frame a triangle");
  if (auto valid = validateMesh(target); !valid) return valid.error();
  if (material.model->needs_grid) {
    return badInput("", "law",
                    "is " + std::string(material.model->id) + ", which means nothing off its grid",
                    "use a material of triangles: soft, stvk, stvk-coupled or edge-hinge");
  }
  InverseShell shell;
  shell.mesh_ = target;
  shell.topology_ = buildTopology(target).value();
  shell.material_ = std::move(material);
  if (shell.material_.model->membrane != MembraneElement::kEdges) {
    if (frames.empty()) {
      if (!target.hasUv()) {
        return badInput("", "uv", "a target without material coordinates has no weft and warp",
                        "give uv in metres, or a direction of the warp");
      }
      auto from_uv = framesFromUv(target);
      if (!from_uv) return from_uv.error();
      frames = std::move(from_uv).value();
    }
    shell.frames_ = std::move(frames);
  }
  if (shell.material_.laws.bending && hasRotations(*shell.material_.model))
    shell.rotation_count_ = static_cast<int>(shell.topology_.edges.size());
  shell.findPattern();
  return shell;
}

Eigen::VectorXd InverseShell::coordinates(const Points3& pose,
                                          const Eigen::VectorXd& rotations) const {
  Eigen::VectorXd q(coordinateCount());
  q << Eigen::Map<const Eigen::VectorXd>(pose.data(), pose.size()), rotations;
  return q;
}

void InverseShell::gradient(const Eigen::VectorXd& q, const Points3& rest,
                            Eigen::VectorXd& out) const {
  out.setZero(coordinateCount());
  Elements elements(
      *this, frames_, q, rest, [&](int row, double value) { out[row] += value; },
      [](int, int, double) {});
  elements.visit();
}

void InverseShell::findPattern() {
  std::vector<std::pair<int, int>> entries;  // column, row
  const Eigen::VectorXd q = coordinates(mesh_.positions, Eigen::VectorXd::Zero(rotation_count_));
  Elements elements(
      *this, frames_, q, mesh_.positions, [](int, double) {},
      [&](int row, int column, double) { entries.emplace_back(column, row); });
  elements.visit();
  std::vector<int> order(entries.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return entries[a] < entries[b]; });
  slots_.resize(entries.size());
  const int n = coordinateCount();
  std::vector<int> rows, begin(static_cast<std::size_t>(n) + 1, 0);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const auto& entry = entries[order[k]];
    if (k == 0 || entry != entries[order[k - 1]]) {
      rows.push_back(entry.second);
      ++begin[static_cast<std::size_t>(entry.first) + 1];
    }
    slots_[order[k]] = static_cast<int>(rows.size()) - 1;
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  const std::vector<double> zeros(rows.size(), 0.0);
  by_rest_ = Eigen::Map<const Sparse>(n, n, static_cast<Eigen::Index>(rows.size()), begin.data(),
                                      rows.data(), zeros.data());
}

const InverseShell::Sparse& InverseShell::gradientByRest(const Eigen::VectorXd& q,
                                                         const Points3& rest) const {
  std::fill_n(by_rest_.valuePtr(), by_rest_.nonZeros(), 0.0);
  double* values = by_rest_.valuePtr();
  std::size_t entry = 0;
  Elements elements(
      *this, frames_, q, rest, [](int, double) {},
      [&](int, int, double value) { values[slots_[entry++]] += value; });
  elements.visit();
  return by_rest_;
}

Eigen::VectorXd InverseShell::mass(const Points3& rest) const {
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(vertexCount());
  for (const Triangle& t : mesh_.triangles) {
    const Vec3 a = rest.col(t[1]) - rest.col(t[0]), b = rest.col(t[2]) - rest.col(t[0]);
    const double third = material_.areal_density_kg_per_m2 * a.cross(b).norm() / 6.0;
    for (const int v : t) mass[v] += third;
  }
  return mass;
}

double InverseShell::weight_N(const Points3& rest) const {
  return mass(rest).sum() * material_.gravity_m_per_s2.norm();
}

bool hasElementRest(const ShellMaterial& material) {
  return material.model->membrane == MembraneElement::kEdges &&
         (!material.laws.bending || material.model->bending == BendingElement::kRawHinge);
}

void InverseShell::setElementRest(std::optional<ElementRest> rest) {
  require(!rest || hasElementRest(material_), "InverseShell: no rest state of elements");
  element_rest_ = std::move(rest);
}

SheetMesh InverseShell::sheet(const Points3& rest) const {
  SheetMesh sheet;
  sheet.rest = mesh_;
  sheet.rest.positions = rest;
  if (!mesh_.hasUv()) sheet.rest.uv = Points2::Zero(2, vertexCount());
  sheet.topology = topology_;
  sheet.pattern = "mesh " + std::to_string(vertexCount()) + " vertices";
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    const Triangle& ids = mesh_.triangles[t];
    const Vec3 a = rest.col(ids[1]) - rest.col(ids[0]), b = rest.col(ids[2]) - rest.col(ids[0]);
    const MaterialFrame inverse = frames_.empty() ? MaterialFrame(MaterialFrame::Identity())
                                                  : MaterialFrame(frames_[t].inverse());
    const Vec3 weft = (inverse(0, 0) * a + inverse(1, 0) * b).normalized();
    const Vec3 cross = a.cross(b);
    const Vec3 warp = (inverse.determinant() < 0.0 ? -1.0 : 1.0) * cross.normalized().cross(weft);
    Mat2 edges;
    edges << a.dot(weft), b.dot(weft), a.dot(warp), b.dot(warp);
    sheet.triangles.push_back({edges.inverse(), 0.5 * cross.norm()});
  }
  return sheet;
}

Result<ClothSystem> InverseShell::system(const Points3& rest, std::vector<int> held_vertices,
                                         std::vector<std::unique_ptr<EnergyTerm>> more) const {
  SheetMesh at_rest = sheet(rest);
  auto terms = element_rest_ ? Result<ClothTerms>(termsOf(material_.laws, at_rest, *element_rest_))
                             : makeClothTerms(*material_.model, material_.laws, at_rest, {},
                                              EdgeRotations::kAll);
  if (!terms) return terms.error();
  for (auto& term : more) terms->terms.push_back(std::move(term));
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = material_.areal_density_kg_per_m2;
  setup.gravity_m_per_s2 = material_.gravity_m_per_s2;
  setup.fixed_nodes = std::move(held_vertices);
  return ClothSystem::create(std::move(at_rest), std::move(terms).value(), std::move(setup));
}

}  // namespace tenter
