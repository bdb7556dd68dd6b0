// SPDX-License-Identifier: GPL-3.0-or-later
#include "axial_term.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "parameter_scratch.h"
#include "tenter/core/result.h"

namespace tenter {
namespace {

using Mat6 = Eigen::Matrix<double, 6, 6>;

class AxialTerm final : public EnergyTerm {
 public:
  AxialTerm(std::vector<AxialElement> elements, std::shared_ptr<const StrainLaw> law)
      : law_(std::move(law)), elements_(std::move(elements)) {
    for (const AxialElement& e : elements_) {
      Stencil s;
      s.node_count = 2;
      s.nodes[0] = e.begin;
      s.nodes[1] = e.end;
      stencils_.push_back(s);
    }
  }

  const std::vector<Stencil>& stencils() const override { return stencils_; }

  double energy(const Eigen::VectorXd& q) const override {
    double sum = 0.0;
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      sum += elements_[k].weight * evaluate(k, state(elements_[k], q)).energy;
    }
    return sum;
  }

  void addGradient(const Eigen::VectorXd& q, Eigen::VectorXd& gradient) const override {
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      const AxialElement& e = elements_[k];
      const State s = state(e, q);
      const double tension = e.weight * evaluate(k, s).stress[e.component] / e.rest_length_m;
      gradient.segment<3>(3 * e.end) += tension * s.direction;
      gradient.segment<3>(3 * e.begin) -= tension * s.direction;
    }
  }

  void addHessian(const Eigen::VectorXd& q, Projection projection,
                  HessianSink& sink) const override {
    Mat6 block;
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      const AxialElement& e = elements_[k];
      const State s = state(e, q);
      const LawValue law = evaluate(k, s);
      const int c = e.component;
      double axial = e.weight * law.tangent(c, c) / (e.rest_length_m * e.rest_length_m);
      double lateral = s.length > std::numeric_limits<double>::min()
                           ? e.weight * law.stress[c] / (e.rest_length_m * s.length)
                           : 0.0;
      if (projection == Projection::kPositiveSemiDefinite) {
        // These two are the block's only eigenvalues (twice each), so clamping them is the
        // projection.
        axial = std::max(axial, 0.0);
        lateral = std::max(lateral, 0.0);
      }
      const Mat3 h =
          lateral * Mat3::Identity() + (axial - lateral) * s.direction * s.direction.transpose();
      block << h, -h, -h, h;
      sink.add(static_cast<int>(k), block.data());
    }
  }

  int parameterCount() const override { return law_->parameterCount(); }

  void addParameterGradient(const Eigen::VectorXd& q,
                            Eigen::Ref<Eigen::MatrixXd> derivative) const override {
    auto by_parameter = parameterScratch(parameterCount());
    for (const AxialElement& e : elements_) {
      const State s = state(e, q);
      law_->stressByParameter(strainVector(e, s), by_parameter);
      const Vec3 rows = (e.weight / e.rest_length_m) * s.direction;
      const auto row = by_parameter.row(e.component);
      derivative.middleRows<3>(3 * e.end) += rows.lazyProduct(row);
      derivative.middleRows<3>(3 * e.begin) -= rows.lazyProduct(row);
    }
  }

  void strains(const Eigen::VectorXd& q, Eigen::Matrix3Xd& out) const override {
    out.resize(3, static_cast<Eigen::Index>(elements_.size()));
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      out.col(static_cast<Eigen::Index>(k)) = strainVector(elements_[k], state(elements_[k], q));
    }
  }

  Eigen::VectorXd elementAreas() const override {
    Eigen::VectorXd areas(static_cast<Eigen::Index>(elements_.size()));
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      areas[static_cast<Eigen::Index>(k)] = elements_[k].weight;
    }
    return areas;
  }

 private:
  struct State {
    double length, strain;
    Vec3 direction;
  };

  static State state(const AxialElement& e, const Eigen::VectorXd& q) {
    const Vec3 d = q.segment<3>(3 * e.end) - q.segment<3>(3 * e.begin);
    const double length = d.norm();
    const double strain = (length - e.rest_length_m) / e.rest_length_m;
    if (!(length > std::numeric_limits<double>::min())) return {0.0, strain, Vec3::Zero()};
    return {length, strain, d / length};
  }

  static Vec3 strainVector(const AxialElement& e, const State& s) {
    Vec3 strain = Vec3::Zero();
    strain[e.component] = s.strain;
    return strain;
  }

  LawValue evaluate(std::size_t k, const State& s) const {
    return law_->evaluate(strainVector(elements_[k], s), static_cast<int>(k));
  }

  std::shared_ptr<const StrainLaw> law_;
  std::vector<AxialElement> elements_;
  std::vector<Stencil> stencils_;
};

}  // namespace

std::unique_ptr<EnergyTerm> makeAxialTerm(std::vector<AxialElement> elements,
                                          std::shared_ptr<const StrainLaw> law) {
  require(law != nullptr, "makeAxialTerm: no law");
  return std::make_unique<AxialTerm>(std::move(elements), std::move(law));
}

}  // namespace tenter
