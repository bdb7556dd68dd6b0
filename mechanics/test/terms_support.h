// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tenter/mechanics/energy_terms.h"

namespace tenter::test_support {

/// Sums element Hessians into a dense matrix, and keeps the smallest eigenvalue of any element
/// relative to its largest.
class DenseHessian final : public HessianSink {
 public:
  DenseHessian(const EnergyTerm& term, int coordinates) : term_(term) {
    matrix.setZero(coordinates, coordinates);
  }

  void add(int element, const double* block) override {
    in_order = in_order && element == next_element_++;
    const Stencil& s = term_.stencils()[element];
    const int n = s.size();
    const Eigen::Map<const Eigen::MatrixXd> values(block, n, n);
    largest_asymmetry =
        std::max(largest_asymmetry, (values - values.transpose()).cwiseAbs().maxCoeff() /
                                        std::max(values.cwiseAbs().maxCoeff(), 1e-300));
    std::vector<int> index;
    for (int k = 0; k < s.node_count; ++k) {
      for (int axis = 0; axis < 3; ++axis) index.push_back(3 * s.nodes[k] + axis);
    }
    for (int k = 0; k < s.scalar_count; ++k) index.push_back(s.scalars[k]);
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) matrix(index[i], index[j]) += values(i, j);
    }
    if (with_eigenvalues) {
      const Eigen::VectorXd eigenvalues =
          Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(values, Eigen::EigenvaluesOnly)
              .eigenvalues();
      const double scale = std::max(eigenvalues.cwiseAbs().maxCoeff(), 1e-300);
      smallest_eigenvalue = std::min(smallest_eigenvalue, eigenvalues.minCoeff() / scale);
    }
  }

  int elements() const { return next_element_; }

  Eigen::MatrixXd matrix;
  bool with_eigenvalues = false;
  bool in_order = true;
  double smallest_eigenvalue = 0.0;
  double largest_asymmetry = 0.0;

 private:
  const EnergyTerm& term_;
  int next_element_ = 0;
};

/// The terms of a model on a sheet, as one function of q.
struct Terms {
  ClothTerms cloth;
  int coordinates = 0;

  double energy(const Eigen::VectorXd& q) const {
    double sum = 0.0;
    for (const auto& term : cloth.terms) sum += term->energy(q);
    return sum;
  }
  Eigen::VectorXd gradient(const Eigen::VectorXd& q) const {
    Eigen::VectorXd g = Eigen::VectorXd::Zero(coordinates);
    for (const auto& term : cloth.terms) term->addGradient(q, g);
    return g;
  }
};

/// Curves that bend: stiffening stretch, even shear and bending; every component with parameters.
inline std::vector<ComponentCurve> curvedComponents(const ClothModel& model) {
  std::vector<ComponentCurve> components;
  for (int c = 0; c < model.componentCount(); ++c) {
    const ComponentInfo& info = model.component(c);
    const bool bending = c >= static_cast<int>(model.membrane_components.size());
    const double scale =
        (bending ? (info.stiffness_unit == "N m" ? 2e-5 : 30.0) : 200.0) * (1.0 + 0.3 * c);
    std::vector<double> knots =
        info.even ? std::vector<double>{0.0, 0.1, 0.3} : std::vector<double>{-0.2, 0.0, 0.15, 0.4};
    if (info.strain_unit == "1/m") knots = {0.0, 20.0, 90.0, 3000.0};
    const SplineBasis basis = info.constant_only ? SplineBasis::constant(info.even)
                                                 : SplineBasis::onKnots(knots, info.even);
    Eigen::VectorXd coefficients(basis.size());
    for (int j = 0; j < basis.size(); ++j)
      coefficients[j] = scale * (1.0 + 0.4 * std::sin(2.0 * j + c));
    // Level ends: where k turns constant with a corner the Hessian jumps, and differences across
    // the jump prove nothing.
    if (basis.size() > 1) coefficients[basis.size() - 1] = coefficients[basis.size() - 2];
    if (basis.size() > 1 && !info.even) coefficients[0] = coefficients[1];
    components.push_back({basis.curve(coefficients), std::make_shared<SplineBasis>(basis)});
  }
  return components;
}

inline Terms makeTerms(const ClothModel& model, const std::vector<ComponentCurve>& components,
                       const SheetMesh& sheet, const std::vector<bool>& rigid = {},
                       EdgeRotations rotations = EdgeRotations::kAutomatic) {
  Terms out;
  out.cloth = makeClothTerms(model, makeLaws(model, components), sheet, rigid, rotations).value();
  out.coordinates = 3 * sheet.nodeCount() + static_cast<int>(out.cloth.rotation_edge.size());
  return out;
}

inline Eigen::VectorXd restCoordinates(const SheetMesh& sheet, int coordinates) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(coordinates);
  for (int i = 0; i < sheet.nodeCount(); ++i) q.segment<3>(3 * i) = sheet.rest.positions.col(i);
  return q;
}

/// Seeded large deformations of a sheet in the plane: rolled up, stretched, jittered.
class DeformedStates {
 public:
  DeformedStates(const SheetMesh& sheet, int coordinates, unsigned seed)
      : sheet_(sheet), coordinates_(coordinates), engine_(seed) {
    edge_ = std::sqrt(2.0 * sheet.area() / sheet.triangleCount());
  }

  double edge() const { return edge_; }
  double uniform() { return std::uniform_real_distribution<double>(-1.0, 1.0)(engine_); }

  Eigen::VectorXd next() {
    Eigen::VectorXd q = Eigen::VectorXd::Zero(coordinates_);
    const double curvature = 0.7 * uniform() / edge_;
    const double stretch_u = 1.0 + 0.2 * uniform(), stretch_v = 1.0 + 0.2 * uniform();
    const double shear = 0.2 * uniform();
    for (int i = 0; i < sheet_.nodeCount(); ++i) {
      const Vec3 x = sheet_.rest.positions.col(i);
      const double u = stretch_u * x[0] + shear * x[1], v = stretch_v * x[1];
      q.segment<3>(3 * i) = Vec3(std::sin(curvature * u) / curvature, v,
                                 (1.0 - std::cos(curvature * u)) / curvature + x[2]);
    }
    for (int i = 0; i < coordinates_; ++i) q[i] += 0.12 * edge_ * uniform();
    const Eigen::Quaterniond turn(
        Eigen::Vector4d(uniform(), uniform(), uniform(), uniform()).normalized());
    for (int i = 0; i < sheet_.nodeCount(); ++i)
      q.segment<3>(3 * i) = turn * Vec3(q.segment<3>(3 * i));
    return q;
  }

  /// The same with one triangle crushed to `height_m`.
  Eigen::VectorXd nextDegenerate(double height_m) {
    Eigen::VectorXd q = next();
    const auto t = static_cast<std::size_t>(engine_() % sheet_.rest.triangles.size());
    const Triangle& nodes = sheet_.rest.triangles[t];
    const Vec3 a = q.segment<3>(3 * nodes[1]), b = q.segment<3>(3 * nodes[2]);
    const Vec3 c = q.segment<3>(3 * nodes[0]);
    const Vec3 foot = a + (0.5 + 0.3 * uniform()) * (b - a);
    const Vec3 across = (c - foot) - (b - a) * ((c - foot).dot(b - a) / (b - a).squaredNorm());
    q.segment<3>(3 * nodes[0]) = foot + height_m * across.normalized();
    return q;
  }

 private:
  const SheetMesh& sheet_;
  int coordinates_;
  std::mt19937 engine_;
  double edge_;
};

}  // namespace tenter::test_support
