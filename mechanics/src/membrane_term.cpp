// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <utility>

#include "parameter_scratch.h"
#include "projection.h"
#include "tenter/mechanics/energy_terms.h"

namespace tenter {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Mat9 = Eigen::Matrix<double, 9, 9>;
using Mat63 = Eigen::Matrix<double, 6, 3>;

/// Everything about one triangle that does not move.
struct Element {
  std::array<int, 3> nodes;
  int triangle;
  double area;
  Eigen::Matrix<double, 3, 2> shape;  ///< d w_u / d x_i and d w_v / d x_i, times the identity.
};

/// Strains of the deformation gradient F = (w_u, w_v), six numbers, and their derivatives.
struct StvkMeasure {
  static Vec3 strain(const Vec6& f) {
    const auto wu = f.head<3>(), wv = f.tail<3>();
    return {0.5 * (wu.squaredNorm() - 1.0), 0.5 * (wv.squaredNorm() - 1.0), wu.dot(wv)};
  }
  static Mat63 gradient(const Vec6& f) {
    Mat63 g;
    g << f.head<3>(), Vec3::Zero(), f.tail<3>(), Vec3::Zero(), f.tail<3>(), f.head<3>();
    return g;
  }
  /// Adds sum_i stress_i d2 e_i / dF2.
  static void addCurvature(const Vec6& /*f*/, const Vec3& stress, Mat6* h) {
    for (int k = 0; k < 3; ++k) {
      (*h)(k, k) += stress[0];
      (*h)(k + 3, k + 3) += stress[1];
      (*h)(k, k + 3) += stress[2];
      (*h)(k + 3, k) += stress[2];
    }
  }
};

struct SoftMeasure {
  // Below this stretch (cloth crushed to a thousandth of a per mille) the direction of w means
  // nothing any more.
  static constexpr double kMinStretch = 1e-6;

  static Vec3 direction(const Vec3& w, double norm) {
    return norm > kMinStretch ? Vec3(w / norm) : Vec3::Zero();
  }
  static Vec3 strain(const Vec6& f) {
    const auto wu = f.head<3>(), wv = f.tail<3>();
    return {wu.norm() - 1.0, wv.norm() - 1.0, wu.dot(wv)};
  }
  static Mat63 gradient(const Vec6& f) {
    const Vec3 wu = f.head<3>(), wv = f.tail<3>();
    Mat63 g;
    g << direction(wu, wu.norm()), Vec3::Zero(), wv, Vec3::Zero(), direction(wv, wv.norm()), wu;
    return g;
  }
  static Mat3 normCurvature(const Vec3& w, double stress) {
    const double norm = w.norm();
    if (norm <= kMinStretch) return Mat3::Zero();
    const Vec3 d = w / norm;
    return (stress / norm) * (Mat3::Identity() - d * d.transpose());
  }
  static void addCurvature(const Vec6& f, const Vec3& stress, Mat6* h) {
    h->topLeftCorner<3, 3>() += normCurvature(f.head<3>(), stress[0]);
    h->bottomRightCorner<3, 3>() += normCurvature(f.tail<3>(), stress[1]);
    for (int k = 0; k < 3; ++k) {
      (*h)(k, k + 3) += stress[2];
      (*h)(k + 3, k) += stress[2];
    }
  }
};

template <class Measure>
class MembraneTerm final : public EnergyTerm {
 public:
  MembraneTerm(const SheetMesh& sheet, std::shared_ptr<const StrainLaw> law,
               const std::vector<bool>& rigid)
      : law_(std::move(law)) {
    for (int t = 0; t < sheet.triangleCount(); ++t) {
      if (!rigid.empty() && rigid[t]) continue;
      const SheetMesh::RestTriangle& rest = sheet.triangles[t];
      Element e{sheet.rest.triangles[t], t, rest.area_m2, {}};
      e.shape.row(1) = rest.edges_inverse.row(0);
      e.shape.row(2) = rest.edges_inverse.row(1);
      e.shape.row(0) = -(e.shape.row(1) + e.shape.row(2));
      elements_.push_back(e);
      Stencil s;
      s.node_count = 3;
      for (int i = 0; i < 3; ++i) s.nodes[i] = e.nodes[i];
      stencils_.push_back(s);
    }
  }

  const std::vector<Stencil>& stencils() const override { return stencils_; }

  double energy(const Eigen::VectorXd& q) const override {
    double sum = 0.0;
    for (const Element& e : elements_) {
      sum += e.area * law_->evaluate(Measure::strain(deformation(e, q)), e.triangle).energy;
    }
    return sum;
  }

  void addGradient(const Eigen::VectorXd& q, Eigen::VectorXd& gradient) const override {
    for (const Element& e : elements_) {
      const Vec6 f = deformation(e, q);
      const LawValue law = law_->evaluate(Measure::strain(f), e.triangle);
      const Vec6 p = e.area * (Measure::gradient(f) * law.stress);
      for (int i = 0; i < 3; ++i) {
        gradient.segment<3>(3 * e.nodes[i]) +=
            e.shape(i, 0) * p.head<3>() + e.shape(i, 1) * p.tail<3>();
      }
    }
  }

  void addHessian(const Eigen::VectorXd& q, Projection projection,
                  HessianSink& sink) const override {
    Mat9 block;
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      const Element& e = elements_[k];
      const Vec6 f = deformation(e, q);
      const LawValue law = law_->evaluate(Measure::strain(f), e.triangle);
      const Mat63 g = Measure::gradient(f);
      Mat6 h = g * (e.area * law.tangent) * g.transpose();
      Measure::addCurvature(f, e.area * law.stress, &h);
      // A congruence keeps semi-definiteness, so the small matrix is the one to project.
      if (projection == Projection::kPositiveSemiDefinite) clampEigenvalues(&h);
      assemble(e, h, &block);
      sink.add(static_cast<int>(k), block.data());
    }
  }

  int parameterCount() const override { return law_->parameterCount(); }

  void addParameterGradient(const Eigen::VectorXd& q,
                            Eigen::Ref<Eigen::MatrixXd> derivative) const override {
    auto by_parameter = parameterScratch(parameterCount());
    for (const Element& e : elements_) {
      const Vec6 f = deformation(e, q);
      law_->stressByParameter(Measure::strain(f), by_parameter);
      const Mat63 g = e.area * Measure::gradient(f);
      for (int i = 0; i < 3; ++i) {
        const Mat3 rows = e.shape(i, 0) * g.topRows<3>() + e.shape(i, 1) * g.bottomRows<3>();
        derivative.middleRows<3>(3 * e.nodes[i]).noalias() += rows.lazyProduct(by_parameter);
      }
    }
  }

  void strains(const Eigen::VectorXd& q, Eigen::Matrix3Xd& out) const override {
    out.resize(3, static_cast<Eigen::Index>(elements_.size()));
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      out.col(static_cast<Eigen::Index>(k)) = Measure::strain(deformation(elements_[k], q));
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
  static Vec6 deformation(const Element& e, const Eigen::VectorXd& q) {
    const double* p = q.data();
    const Eigen::Map<const Vec3> x0(p + 3 * e.nodes[0]), x1(p + 3 * e.nodes[1]),
        x2(p + 3 * e.nodes[2]);
    const Vec3 d1 = x1 - x0, d2 = x2 - x0;
    Vec6 f;
    f.head<3>() = e.shape(1, 0) * d1 + e.shape(2, 0) * d2;
    f.tail<3>() = e.shape(1, 1) * d1 + e.shape(2, 1) * d2;
    return f;
  }

  /// Block (i, j) = sum over a, b of shape(i, a) shape(j, b) H_ab.
  static void assemble(const Element& e, const Mat6& h, Mat9* block) {
    const Mat3 uu = h.topLeftCorner<3, 3>(), uv = h.topRightCorner<3, 3>();
    const Mat3 vv = h.bottomRightCorner<3, 3>();
    for (int i = 0; i < 3; ++i) {
      const Mat3 left_u = e.shape(i, 0) * uu + e.shape(i, 1) * uv.transpose();
      const Mat3 left_v = e.shape(i, 0) * uv + e.shape(i, 1) * vv;
      for (int j = i; j < 3; ++j) {
        const Mat3 b = e.shape(j, 0) * left_u + e.shape(j, 1) * left_v;
        block->block<3, 3>(3 * i, 3 * j) = b;
        if (j != i) block->block<3, 3>(3 * j, 3 * i) = b.transpose();
      }
    }
  }

  std::shared_ptr<const StrainLaw> law_;
  std::vector<Element> elements_;
  std::vector<Stencil> stencils_;
};

}  // namespace

std::unique_ptr<EnergyTerm> makeMembraneTerm(const SheetMesh& sheet, MembraneElement measure,
                                             std::shared_ptr<const StrainLaw> law,
                                             const std::vector<bool>& rigid_triangles) {
  require(law != nullptr, "makeMembraneTerm: no law");
  require(
      rigid_triangles.empty() || static_cast<int>(rigid_triangles.size()) == sheet.triangleCount(),
      "makeMembraneTerm: one rigid mark per triangle");
  if (measure == MembraneElement::kStvk) {
    return std::make_unique<MembraneTerm<StvkMeasure>>(sheet, std::move(law), rigid_triangles);
  }
  require(measure == MembraneElement::kSoft, "makeMembraneTerm: not a measure of triangles");
  return std::make_unique<MembraneTerm<SoftMeasure>>(sheet, std::move(law), rigid_triangles);
}

}  // namespace tenter
