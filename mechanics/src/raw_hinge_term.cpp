// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <utility>

#include "angle_difference.h"
#include "parameter_scratch.h"
#include "tenter/mechanics/dihedral_angle.h"
#include "tenter/mechanics/element_rest.h"

namespace tenter {
namespace {

struct Element {
  std::array<int, 4> nodes;
  double rest_angle;
  double weight;  ///< 3 L0^2 / A, no unit.
  double area;
};

class RawHingeTerm final : public EnergyTerm {
 public:
  /// @param element_rest  gives the rest angles unless null.
  RawHingeTerm(const SheetMesh& sheet, std::shared_ptr<const StrainLaw> law,
               const ElementRest* element_rest)
      : law_(std::move(law)) {
    const Eigen::VectorXd rest =
        Eigen::Map<const Eigen::VectorXd>(sheet.rest.positions.data(), 3 * sheet.nodeCount());
    for (std::size_t k = 0; k < sheet.topology.edges.size(); ++k) {
      const MeshEdge& edge = sheet.topology.edges[k];
      if (edge.triangles[1] < 0) continue;
      Element e{{edge.vertices[0], edge.vertices[1], edge.opposite[0], edge.opposite[1]}, 0, 0, 0};
      const double length2 =
          (rest.segment<3>(3 * e.nodes[1]) - rest.segment<3>(3 * e.nodes[0])).squaredNorm();
      e.area =
          sheet.triangles[edge.triangles[0]].area_m2 + sheet.triangles[edge.triangles[1]].area_m2;
      e.weight = 3.0 * length2 / e.area;
      e.rest_angle = element_rest ? element_rest->angle_rad[static_cast<Eigen::Index>(k)]
                                  : dihedralAngle(positions(e, rest));
      elements_.push_back(e);
      Stencil s;
      s.node_count = 4;
      std::copy(e.nodes.begin(), e.nodes.end(), s.nodes.begin());
      stencils_.push_back(s);
    }
  }

  const std::vector<Stencil>& stencils() const override { return stencils_; }

  double energy(const Eigen::VectorXd& q) const override {
    double sum = 0.0;
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      const Element& e = elements_[k];
      sum += e.weight * law_->evaluate(strain(e, q, nullptr, nullptr), static_cast<int>(k)).energy;
    }
    return sum;
  }

  void addGradient(const Eigen::VectorXd& q, Eigen::VectorXd& gradient) const override {
    Vec12 g;
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      const Element& e = elements_[k];
      const LawValue law = law_->evaluate(strain(e, q, &g, nullptr), static_cast<int>(k));
      g *= e.weight * law.stress[0];
      for (int i = 0; i < 4; ++i) gradient.segment<3>(3 * e.nodes[i]) += g.segment<3>(3 * i);
    }
  }

  void addHessian(const Eigen::VectorXd& q, Projection projection,
                  HessianSink& sink) const override {
    const bool project = projection == Projection::kPositiveSemiDefinite;
    Vec12 g;
    Mat12 block;
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      const Element& e = elements_[k];
      const Vec3 s = strain(e, q, &g, project ? nullptr : &block);
      const LawValue law = law_->evaluate(s, static_cast<int>(k));
      const double tangent = e.weight * law.tangent(0, 0);
      if (project) {
        // The second derivative of an angle is never semi-definite: Gauss-Newton leaves it out.
        block.noalias() = (std::max(tangent, 0.0) * g) * g.transpose();
      } else {
        block *= e.weight * law.stress[0];
        block.noalias() += (tangent * g) * g.transpose();
      }
      sink.add(static_cast<int>(k), block.data());
    }
  }

  int parameterCount() const override { return law_->parameterCount(); }

  void addParameterGradient(const Eigen::VectorXd& q,
                            Eigen::Ref<Eigen::MatrixXd> derivative) const override {
    auto by_parameter = parameterScratch(parameterCount());
    Vec12 g;
    for (const Element& e : elements_) {
      law_->stressByParameter(strain(e, q, &g, nullptr), by_parameter);
      g *= e.weight;
      for (int i = 0; i < 4; ++i) {
        derivative.middleRows<3>(3 * e.nodes[i]) +=
            g.segment<3>(3 * i).lazyProduct(by_parameter.row(0));
      }
    }
  }

  void strains(const Eigen::VectorXd& q, Eigen::Matrix3Xd& out) const override {
    out.resize(3, static_cast<Eigen::Index>(elements_.size()));
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      out.col(static_cast<Eigen::Index>(k)) = strain(elements_[k], q, nullptr, nullptr);
    }
  }

  Eigen::VectorXd elementAreas() const override {
    Eigen::VectorXd areas(static_cast<Eigen::Index>(elements_.size()));
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      areas[static_cast<Eigen::Index>(k)] = elements_[k].area;
    }
    return areas;
  }

 private:
  static Vec12 positions(const Element& e, const Eigen::VectorXd& q) {
    Vec12 x;
    for (int i = 0; i < 4; ++i) x.segment<3>(3 * i) = q.segment<3>(3 * e.nodes[i]);
    return x;
  }

  static Vec3 strain(const Element& e, const Eigen::VectorXd& q, Vec12* gradient, Mat12* hessian) {
    const double angle = dihedralAngle(positions(e, q), gradient, hessian);
    return {angleDifference(angle, e.rest_angle), 0.0, 0.0};
  }

  std::shared_ptr<const StrainLaw> law_;
  std::vector<Element> elements_;
  std::vector<Stencil> stencils_;
};

}  // namespace

std::unique_ptr<EnergyTerm> makeRawHingeTerm(const SheetMesh& sheet,
                                             std::shared_ptr<const StrainLaw> law) {
  require(law != nullptr, "makeRawHingeTerm: no law");
  return std::make_unique<RawHingeTerm>(sheet, std::move(law), nullptr);
}

std::unique_ptr<EnergyTerm> makeRawHingeTerm(const SheetMesh& sheet,
                                             std::shared_ptr<const StrainLaw> law,
                                             const ElementRest& rest) {
  require(law != nullptr, "makeRawHingeTerm: no law");
  require(rest.angle_rad.size() == static_cast<Eigen::Index>(sheet.topology.edges.size()),
          "makeRawHingeTerm: one rest angle an edge");
  return std::make_unique<RawHingeTerm>(sheet, std::move(law), &rest);
}

}  // namespace tenter
