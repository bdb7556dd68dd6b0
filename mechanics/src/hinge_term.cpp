// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <utility>

#include "angle_difference.h"
#include "hinge_elements.h"
#include "parameter_scratch.h"
#include "projection.h"
#include "tenter/mechanics/dihedral_angle.h"
#include "tenter/mechanics/element_rest.h"
#include "tenter/mechanics/energy_terms.h"

namespace tenter {
namespace {

constexpr int kMaxSize = 3 * Stencil::kMaxNodes + Stencil::kMaxScalars;
/// d a_c / d(local coordinates), one column a side.
using SideGradients = Eigen::Matrix<double, kMaxSize, 3>;

/// Per thread and grown once: what an edge's two triangles share.
struct Scratch {
  std::vector<double> bend;     ///< theta - theta0 of each hinge edge.
  std::vector<Vec12> gradient;  ///< d theta / dx.
  std::vector<double> moment;   ///< dE / d theta, summed over the triangles.
  std::vector<Mat3> tangent;    ///< d2E / da da of each triangle.
};

Scratch& scratch() {
  static thread_local Scratch s;
  return s;
}

template <class T>
void grow(std::vector<T>* v, std::size_t size) {
  if (v->size() < size) v->resize(size);
}

class HingeBending final : public EnergyTerm {
 public:
  HingeBending(HingeElements elements, std::shared_ptr<const StrainLaw> law)
      : law_(std::move(law)), elements_(std::move(elements)) {}

  const std::vector<Stencil>& stencils() const override { return elements_.stencils; }

  double energy(const Eigen::VectorXd& q) const override {
    Scratch& s = scratch();
    measureEdges(q, false, &s);
    double sum = 0.0;
    for (const HingeTriangle& t : elements_.triangles) {
      sum += t.area * law_->evaluate(strain(t, q, s), t.triangle).energy;
    }
    return sum;
  }

  void addGradient(const Eigen::VectorXd& q, Eigen::VectorXd& gradient) const override {
    Scratch& s = scratch();
    measureEdges(q, true, &s);
    grow(&s.moment, elements_.edges.size());
    std::fill(s.moment.begin(), s.moment.end(), 0.0);
    for (const HingeTriangle& t : elements_.triangles) {
      const Vec3 stress = t.area * law_->evaluate(strain(t, q, s), t.triangle).stress;
      for (const HingeSide& side : t.sides) {
        const double moment = side.strain.dot(stress);
        if (side.edge >= 0) s.moment[side.edge] += side.angle_share * moment;
        if (side.scalar >= 0) gradient[side.coordinate] += side.rotation_share * moment;
      }
    }
    for (std::size_t e = 0; e < elements_.edges.size(); ++e) {
      for (int i = 0; i < 4; ++i) {
        gradient.segment<3>(3 * elements_.edges[e].nodes[i]) +=
            s.moment[e] * s.gradient[e].segment<3>(3 * i);
      }
    }
  }

  void addHessian(const Eigen::VectorXd& q, Projection projection,
                  HessianSink& sink) const override {
    const bool project = projection == Projection::kPositiveSemiDefinite;
    Scratch& s = scratch();
    measureEdges(q, true, &s);
    evaluateTriangles(q, project, &s);
    std::array<double, kMaxSize * kMaxSize> block;
    for (std::size_t k = 0; k < elements_.triangles.size(); ++k) {
      const HingeTriangle& t = elements_.triangles[k];
      const int size = elements_.stencils[k].size();
      product(sideGradients(t, elements_.stencils[k], s), s.tangent[k], size, block.data());
      // Second derivatives of angles are never semi-definite: a projected block leaves them out
      // (Gauss-Newton).
      if (!project) addAngleCurvatures(t, q, s, size, block.data());
      sink.add(static_cast<int>(k), block.data());
    }
  }

  int parameterCount() const override { return law_->parameterCount(); }

  void addParameterGradient(const Eigen::VectorXd& q,
                            Eigen::Ref<Eigen::MatrixXd> derivative) const override {
    Scratch& s = scratch();
    measureEdges(q, true, &s);
    auto by_parameter = parameterScratch(parameterCount());
    for (const HingeTriangle& t : elements_.triangles) {
      law_->stressByParameter(strain(t, q, s), by_parameter);
      for (const HingeSide& side : t.sides) {
        const Eigen::RowVector3d moment = t.area * side.strain.transpose();
        if (side.scalar >= 0) {
          derivative.row(side.coordinate) +=
              (side.rotation_share * moment).lazyProduct(by_parameter);
        }
        if (side.edge < 0) continue;
        for (int i = 0; i < 4; ++i) {
          const Mat3 rows = side.angle_share * s.gradient[side.edge].segment<3>(3 * i) * moment;
          derivative.middleRows<3>(3 * elements_.edges[side.edge].nodes[i]) +=
              rows.lazyProduct(by_parameter);
        }
      }
    }
  }

  void strains(const Eigen::VectorXd& q, Eigen::Matrix3Xd& out) const override {
    Scratch& s = scratch();
    measureEdges(q, false, &s);
    out.resize(3, static_cast<Eigen::Index>(elements_.triangles.size()));
    for (std::size_t k = 0; k < elements_.triangles.size(); ++k) {
      out.col(static_cast<Eigen::Index>(k)) = strain(elements_.triangles[k], q, s);
    }
  }

  Eigen::VectorXd elementAreas() const override {
    Eigen::VectorXd areas(static_cast<Eigen::Index>(elements_.triangles.size()));
    for (std::size_t k = 0; k < elements_.triangles.size(); ++k) {
      areas[static_cast<Eigen::Index>(k)] = elements_.triangles[k].area;
    }
    return areas;
  }

 private:
  static Vec12 positions(const HingeEdge& e, const Eigen::VectorXd& q) {
    Vec12 x;
    for (int i = 0; i < 4; ++i) x.segment<3>(3 * i) = q.segment<3>(3 * e.nodes[i]);
    return x;
  }

  void measureEdges(const Eigen::VectorXd& q, bool gradients, Scratch* s) const {
    grow(&s->bend, elements_.edges.size());
    grow(&s->gradient, elements_.edges.size());
    for (std::size_t k = 0; k < elements_.edges.size(); ++k) {
      const HingeEdge& e = elements_.edges[k];
      const double angle = dihedralAngle(positions(e, q), gradients ? &s->gradient[k] : nullptr);
      s->bend[k] = angleDifference(angle, e.rest_angle);
    }
  }

  static Vec3 strain(const HingeTriangle& t, const Eigen::VectorXd& q, const Scratch& s) {
    Vec3 strain = Vec3::Zero();
    for (const HingeSide& side : t.sides) {
      double a = side.edge >= 0 ? side.angle_share * s.bend[side.edge] : 0.0;
      if (side.scalar >= 0) a += side.rotation_share * q[side.coordinate];
      strain += a * side.strain;
    }
    return strain;
  }

  /// Moments of the edges and the 3 x 3 tangent of every triangle in its three side angles.
  void evaluateTriangles(const Eigen::VectorXd& q, bool project, Scratch* s) const {
    grow(&s->moment, elements_.edges.size());
    grow(&s->tangent, elements_.triangles.size());
    std::fill(s->moment.begin(), s->moment.end(), 0.0);
    for (std::size_t k = 0; k < elements_.triangles.size(); ++k) {
      const HingeTriangle& t = elements_.triangles[k];
      const LawValue law = law_->evaluate(strain(t, q, *s), t.triangle);
      Mat3 by_angle;
      for (int c = 0; c < 3; ++c) {
        const HingeSide& side = t.sides[c];
        by_angle.col(c) = side.strain;
        if (side.edge < 0) continue;
        s->moment[side.edge] += side.angle_share * t.area * side.strain.dot(law.stress);
      }
      Mat3 tangent = t.area * law.tangent;
      if (project) clampEigenvalues(&tangent);
      s->tangent[k] = by_angle.transpose() * tangent * by_angle;
    }
  }

  static SideGradients sideGradients(const HingeTriangle& t, const Stencil& stencil,
                                     const Scratch& s) {
    SideGradients g = SideGradients::Zero();
    for (int c = 0; c < 3; ++c) {
      const HingeSide& side = t.sides[c];
      if (side.scalar >= 0) g(3 * stencil.node_count + side.scalar, c) = side.rotation_share;
      if (side.edge < 0) continue;
      for (int i = 0; i < 4; ++i) {
        g.block<3, 1>(3 * side.local[i], c) =
            side.angle_share * s.gradient[side.edge].segment<3>(3 * i);
      }
    }
    return g;
  }

  /// block = G C G^T over the first `size` rows of G.
  static void product(const SideGradients& g, const Mat3& c, int size, double* block) {
    const SideGradients m = g.lazyProduct(c);
    const double* m0 = m.col(0).data();
    const double* m1 = m.col(1).data();
    const double* m2 = m.col(2).data();
    for (int j = 0; j < size; ++j) {
      const double g0 = g(j, 0), g1 = g(j, 1), g2 = g(j, 2);
      double* column = block + static_cast<std::ptrdiff_t>(j) * size;
      for (int i = 0; i < size; ++i) column[i] = m0[i] * g0 + m1[i] * g1 + m2[i] * g2;
    }
  }

  void addAngleCurvatures(const HingeTriangle& t, const Eigen::VectorXd& q, const Scratch& s,
                          int size, double* block) const {
    Mat12 curvature;
    for (const HingeSide& side : t.sides) {
      if (!side.owner) continue;
      dihedralAngle(positions(elements_.edges[side.edge], q), nullptr, &curvature);
      const double moment = s.moment[side.edge];
      for (int b = 0; b < 4; ++b) {
        for (int k = 0; k < 3; ++k) {
          double* column = block + static_cast<std::ptrdiff_t>(3 * side.local[b] + k) * size;
          const double* from = curvature.col(3 * b + k).data();
          for (int a = 0; a < 4; ++a) {
            double* to = column + 3 * side.local[a];
            for (int i = 0; i < 3; ++i) to[i] += moment * from[3 * a + i];
          }
        }
      }
    }
  }

  std::shared_ptr<const StrainLaw> law_;
  HingeElements elements_;
};

HingeTerm termOf(HingeElements elements, std::shared_ptr<const StrainLaw> law) {
  HingeTerm out;
  out.rotation_edge = elements.rotation_edge;
  out.rotation_count = static_cast<int>(elements.rotation_edge.size());
  out.term = std::make_unique<HingeBending>(std::move(elements), std::move(law));
  return out;
}

}  // namespace

HingeTerm makeHingeTerm(const SheetMesh& sheet, std::shared_ptr<const StrainLaw> law,
                        const std::vector<bool>& rigid_triangles, EdgeRotations rotations,
                        int first_coordinate) {
  require(law != nullptr, "makeHingeTerm: no law");
  require(
      rigid_triangles.empty() || static_cast<int>(rigid_triangles.size()) == sheet.triangleCount(),
      "makeHingeTerm: one rigid mark per triangle");
  return termOf(buildHingeElements(sheet, rigid_triangles, rotations, first_coordinate),
                std::move(law));
}

HingeTerm makeHingeTerm(const SheetMesh& sheet, std::shared_ptr<const StrainLaw> law,
                        EdgeRotations rotations, int first_coordinate, const ElementRest& rest) {
  require(law != nullptr, "makeHingeTerm: no law");
  require(rest.angle_rad.size() == static_cast<Eigen::Index>(sheet.topology.edges.size()),
          "makeHingeTerm: one rest angle a mesh edge");
  HingeElements elements = buildHingeElements(sheet, {}, rotations, first_coordinate);
  std::size_t hinge = 0;  // without rigid triangles every inner edge is one, in the mesh's order
  for (std::size_t e = 0; e < sheet.topology.edges.size(); ++e)
    if (sheet.topology.edges[e].triangles[1] >= 0)
      elements.edges[hinge++].rest_angle = rest.angle_rad[static_cast<Eigen::Index>(e)];
  return termOf(std::move(elements), std::move(law));
}

}  // namespace tenter
