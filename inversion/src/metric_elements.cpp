// SPDX-License-Identifier: GPL-3.0-or-later
#include "metric_elements.h"

#include <cmath>
#include <numbers>
#include <string>

#include "tenter/inversion/softness_proof.h"

namespace tenter {
namespace {

/// Stiffness at that strain, in which a constant one does not change.
double tangentOf(const StrainLaw& law, double strain, int element) {
  return law.evaluate(Vec3(strain, 0.0, 0.0), element).tangent(0, 0);
}

bool isConstant(const StrainLaw& law) {
  const double at_rest = tangentOf(law, 0.0, 0);
  for (const double strain : {-0.4, 0.1, 1.0})
    if (std::abs(tangentOf(law, strain, 0) - at_rest) > 1e-12 * std::abs(at_rest)) return false;
  return at_rest > 0.0;
}

MetricElement edgeElement(const MeshEdge& edge, int id, const Points3& x, double k) {
  MetricElement out{.edge = id, .nodes = {edge.vertices[0], edge.vertices[1]}};
  const Vec3 along = x.col(edge.vertices[1]) - x.col(edge.vertices[0]);
  const double length = along.norm();
  // dE/dx = k z u, and with 1 / L0 = (1 + z) / l its derivative is k / l (z I + u u^T).
  out.force.segment<3>(0) = -k / length * along;
  out.force.segment<3>(3) = k / length * along;
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b)
      out.block.block<3, 3>(3 * a, 3 * b) = (a == b ? k : -k) / length * Mat3::Identity();
  out.stiffness = k * length;
  out.value = length;
  out.lower = 1.0 / kStretchLimit - 1.0;
  out.upper = kStretchLimit - 1.0;
  return out;
}

MetricElement hingeElement(const MeshEdge& edge, int id, const Points3& x, double k, double area) {
  MetricElement out{.edge = id, .hinge = true, .node_count = 4};
  out.nodes = {edge.vertices[0], edge.vertices[1], edge.opposite[0], edge.opposite[1]};
  Vec12 at;
  for (int i = 0; i < 4; ++i) at.segment<3>(3 * i) = x.col(out.nodes[i]);
  out.value = dihedralAngle(at, &out.force, &out.block);
  const Vec3 along = at.segment<3>(3) - at.segment<3>(0);
  out.stiffness = 3.0 * along.squaredNorm() / area * k;
  out.force *= out.stiffness;
  out.block *= out.stiffness;
  out.lower = -std::numbers::pi;
  out.upper = std::numbers::pi;
  return out;
}

}  // namespace

Result<MetricElements> MetricElements::create(const InverseShell& shell) {
  const ClothLaws& laws = shell.material().laws;
  if (hasElementRest(shell.material()) && !laws.bending)
    return usageError("a metric rest state needs a bending stiffness", "give --k-bend above 0");
  if (!hasElementRest(shell.material()) || !isConstant(*laws.membrane) ||
      !isConstant(*laws.bending)) {
    return usageError(
        "a metric rest state is known for edges and hinges of constant stiffness only",
        "give --rho, --k-stretch and --k-bend, or leave --rest metric away");
  }
  MetricElements out;
  out.vertices_ = shell.vertexCount();
  const auto& edges = shell.topology().edges;
  const Points3& x = shell.target().positions;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const int id = static_cast<int>(e);
    out.all_.push_back(edgeElement(edges[e], id, x, tangentOf(*laws.membrane, 0.0, id)));
  }
  out.edges_ = out.count();
  const SheetMesh sheet = shell.sheet(x);
  int hinge = 0;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (edges[e].triangles[1] < 0) continue;
    const double area = sheet.triangles[edges[e].triangles[0]].area_m2 +
                        sheet.triangles[edges[e].triangles[1]].area_m2;
    out.all_.push_back(hingeElement(edges[e], static_cast<int>(e), x,
                                    tangentOf(*laws.bending, 0.0, hinge++), area));
  }
  return out;
}

Eigen::VectorXd MetricElements::forces(const Eigen::VectorXd& z) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(vertices_));
  for (std::size_t i = 0; i < all_.size(); ++i)
    for (int a = 0; a < all_[i].node_count; ++a)
      out.segment<3>(3 * all_[i].nodes[a]) +=
          z[static_cast<Eigen::Index>(i)] * all_[i].force.segment<3>(3 * a);
  return out;
}

Eigen::VectorXd MetricElements::works(const Eigen::VectorXd& motion) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(count());
  for (std::size_t i = 0; i < all_.size(); ++i)
    for (int a = 0; a < all_[i].node_count; ++a)
      out[static_cast<Eigen::Index>(i)] +=
          all_[i].force.segment<3>(3 * a).dot(motion.segment<3>(3 * all_[i].nodes[a]));
  return out;
}

Eigen::VectorXd MetricElements::curvatures(const Eigen::MatrixXd& columns) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(count());
  Eigen::MatrixXd local(12, columns.cols());
  for (std::size_t i = 0; i < all_.size(); ++i) {
    const MetricElement& e = all_[i];
    const int n = 3 * e.node_count;
    for (int a = 0; a < e.node_count; ++a)
      local.middleRows<3>(3 * a) = columns.middleRows<3>(3 * e.nodes[a]);
    out[static_cast<Eigen::Index>(i)] =
        local.topRows(n).cwiseProduct(e.block.topLeftCorner(n, n) * local.topRows(n)).sum();
  }
  return out;
}

Eigen::MatrixXd MetricElements::stiffened(const Eigen::VectorXd& z,
                                          const Eigen::MatrixXd& columns) const {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(columns.rows(), columns.cols());
  for (std::size_t i = 0; i < all_.size(); ++i) {
    const MetricElement& e = all_[i];
    for (int a = 0; a < e.node_count; ++a)
      for (int b = 0; b < e.node_count; ++b)
        out.middleRows<3>(3 * e.nodes[a]).noalias() +=
            (z[static_cast<Eigen::Index>(i)] * e.block.block<3, 3>(3 * a, 3 * b)) *
            columns.middleRows<3>(3 * e.nodes[b]);
  }
  return out;
}

ElementRest MetricElements::restOf(const Eigen::VectorXd& z) const {
  ElementRest rest{Eigen::VectorXd::Zero(edges_), Eigen::VectorXd::Zero(edges_)};
  for (std::size_t i = 0; i < all_.size(); ++i) {
    const MetricElement& e = all_[i];
    const double at = z[static_cast<Eigen::Index>(i)];
    if (e.hinge)
      rest.angle_rad[e.edge] = std::remainder(e.value - at, 2.0 * std::numbers::pi);
    else
      rest.length_m[e.edge] = e.value / (1.0 + at);
  }
  return rest;
}

}  // namespace tenter
