// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/rest_preference.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tenter/inversion/contacts.h"
#include "tenter/mechanics/dihedral_angle.h"
#include "tenter/mechanics/energy_terms.h"

namespace tenter {
namespace {

double angleOf(const MeshEdge& edge, const Points3& x) {
  if (edge.triangles[1] < 0) return 0.0;
  Vec12 at;
  at << x.col(edge.vertices[0]), x.col(edge.vertices[1]), x.col(edge.opposite[0]),
      x.col(edge.opposite[1]);
  return dihedralAngle(at);
}

double rmsOf(const Eigen::VectorXd& values, Eigen::Index count) {
  return count > 0 ? std::sqrt(values.squaredNorm() / static_cast<double>(count)) : 0.0;
}

/// Marks of the vertices on a border.
std::vector<char> onBorder(const MeshTopology& topology, int vertex_count) {
  std::vector<char> border(static_cast<std::size_t>(vertex_count), 0);
  for (const MeshEdge& e : topology.edges)
    if (e.triangles[1] < 0)
      for (const int v : e.vertices) border[static_cast<std::size_t>(v)] = 1;
  return border;
}

}  // namespace

ElementRest elementsOf(const MeshTopology& topology, const Points3& positions) {
  const auto count = static_cast<Eigen::Index>(topology.edges.size());
  ElementRest out{Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (Eigen::Index e = 0; e < count; ++e) {
    const MeshEdge& edge = topology.edges[static_cast<std::size_t>(e)];
    out.length_m[e] = (positions.col(edge.vertices[1]) - positions.col(edge.vertices[0])).norm();
    out.angle_rad[e] = angleOf(edge, positions);
  }
  return out;
}

Points3 faired(const TriangleMesh& mesh, double length_m) {
  const int n = mesh.vertexCount();
  const MeshTopology topology = buildTopology(mesh).value();
  const std::vector<char> border = onBorder(topology, n);
  Eigen::VectorXd area = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::Triplet<double>> cotangents;  // rows of inner vertices only
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const int i = t[(k + 1) % 3], j = t[(k + 2) % 3];
      const Vec3 a = mesh.positions.col(i) - mesh.positions.col(t[k]);
      const Vec3 b = mesh.positions.col(j) - mesh.positions.col(t[k]);
      const double twice_area = a.cross(b).norm();
      const double weight = 0.5 * a.dot(b) / twice_area;
      area[t[k]] += twice_area / 6.0;
      for (const auto& [row, column] : {std::pair{i, j}, {j, i}}) {
        if (border[static_cast<std::size_t>(row)]) continue;
        cotangents.emplace_back(row, row, weight);
        cotangents.emplace_back(row, column, -weight);
      }
    }
  }
  Eigen::SparseMatrix<double> k(n, n);
  k.setFromTriplets(cotangents.begin(), cotangents.end());
  Eigen::SparseMatrix<double> system =
      std::pow(length_m, 4) * (k.transpose() * area.cwiseInverse().asDiagonal() * k);
  for (int v = 0; v < n; ++v) system.coeffRef(v, v) += area[v];
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(system);
  if (factors.info() != Eigen::Success) return mesh.positions;
  const Eigen::MatrixXd right = area.asDiagonal() * mesh.positions.transpose();
  Points3 out = factors.solve(right).transpose();
  if (!out.allFinite()) return mesh.positions;
  return out;
}

Eigen::VectorXd fairedAngles(const InverseShell& shell, double smoothing_length_m) {
  const TriangleMesh& target = shell.target();
  const double length =
      smoothing_length_m > 0.0 ? smoothing_length_m : kSmoothing * sizeOf(target.positions);
  return elementsOf(shell.topology(), faired(target, length)).angle_rad;
}

Eigen::VectorXd wantedAngles(const InverseShell& shell, const RestPreference& preference) {
  const Eigen::VectorXd angles = elementsOf(shell.topology(), shell.target().positions).angle_rad;
  if (preference.kind == RestShapeKind::kNearTarget) return angles;
  Eigen::VectorXd wanted = preference.kind == RestShapeKind::kSmooth
                               ? fairedAngles(shell, preference.smoothing_length_m)
                               : Eigen::VectorXd::Zero(angles.size());
  // The short way round, should an angle be near pi.
  for (Eigen::Index e = 0; e < angles.size(); ++e)
    wanted[e] = angles[e] +
                preference.share * std::remainder(wanted[e] - angles[e], 2.0 * std::numbers::pi);
  return wanted;
}

Eigen::VectorXd bendingGradient(const InverseShell& shell, const Eigen::VectorXd& rest_angle_rad) {
  const Points3& pose = shell.target().positions;
  const ShellMaterial& material = shell.material();
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(shell.coordinateCount());
  if (!material.laws.bending) return gradient;
  ElementRest rest = elementsOf(shell.topology(), pose);
  rest.angle_rad = rest_angle_rad;
  const SheetMesh sheet = shell.sheet(pose);
  const std::unique_ptr<EnergyTerm> term =
      material.model->bending == BendingElement::kRawHinge
          ? makeRawHingeTerm(sheet, material.laws.bending, rest)
          : makeHingeTerm(sheet, material.laws.bending, EdgeRotations::kAll,
                          3 * shell.vertexCount(), rest)
                .term;
  term->addGradient(shell.coordinates(pose, Eigen::VectorXd::Zero(shell.rotationCount())),
                    gradient);
  return gradient;
}

ShapeMeasures measureShape(const InverseShell& shell, const ElementRest& rest,
                           const Eigen::VectorXd& faired_angle_rad) {
  const MeshTopology& topology = shell.topology();
  const TriangleMesh& mesh = shell.target();
  const Eigen::Index hinges =
      std::ranges::count_if(topology.edges, [](const MeshEdge& e) { return e.triangles[1] >= 0; });
  ShapeMeasures out;
  out.bend_rms_rad = rmsOf(rest.angle_rad, hinges);
  Eigen::VectorXd folds = rest.angle_rad - faired_angle_rad;
  for (double& fold : folds) fold = std::remainder(fold, 2.0 * std::numbers::pi);
  out.fold_rms_rad = rmsOf(folds, hinges);
  Eigen::VectorXd defect = Eigen::VectorXd::Constant(mesh.vertexCount(), 2.0 * std::numbers::pi);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto length = [&](int corner) {
      return rest.length_m[topology.triangle_edges[t][static_cast<std::size_t>(corner % 3)]];
    };
    for (int k = 0; k < 3; ++k) {
      const double a = length(k), b = length(k + 1), c = length(k + 2);
      defect[mesh.triangles[t][k]] -=
          std::acos(std::clamp((b * b + c * c - a * a) / (2.0 * b * c), -1.0, 1.0));
    }
  }
  const std::vector<char> border = onBorder(topology, mesh.vertexCount());
  for (std::size_t v = 0; v < border.size(); ++v)
    if (border[v]) defect[static_cast<Eigen::Index>(v)] = 0.0;
  out.defect_rms_rad = rmsOf(defect, std::ranges::count(border, 0));
  return out;
}

}  // namespace tenter
