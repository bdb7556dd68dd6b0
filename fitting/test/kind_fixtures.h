// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string_view>
#include <vector>

#include "tenter/fitting/fit_test.h"

namespace tenter::kinds {

inline const ClothModel& modelNamed(std::string_view id) { return *findClothModel(id).value(); }

/// Curves with a basis: constant times (1 + slope |e| / range) on the knots {0, range} or {-range,
/// 0, range}.
inline ComponentCurve splineCurve(double stiffness, double slope, double range, bool even) {
  std::vector<double> knots = even ? std::vector<double>{0.0, 0.5 * range, range}
                                   : std::vector<double>{-0.5 * range, 0.5 * range, range};
  auto basis = std::make_shared<SplineBasis>(SplineBasis::onKnots(knots, even));
  Eigen::VectorXd coefficients(basis->size());
  for (int i = 0; i < basis->size(); ++i)
    coefficients[i] = stiffness * (1.0 + slope * i / (basis->size() - 1.0));
  return {basis->curve(coefficients), basis};
}

inline ComponentCurve constantCurve(double stiffness, bool with_basis = true) {
  auto basis = std::make_shared<SplineBasis>(SplineBasis::constant());
  return {StiffnessCurve::constant(stiffness), with_basis ? basis : nullptr};
}

/// A cotton-like cloth: every component that may be a curve is one, all of them free.
inline ParameterSet clothParameters(const ClothModel& model, double strain_range = 0.05) {
  ParameterSet set;
  set.model = &model;
  for (int i = 0; i < model.componentCount(); ++i) {
    const ComponentInfo& info = model.component(i);
    const bool springs = model.bending == BendingElement::kSprings;
    if (info.name == "stretch_weft")
      set.components.push_back(splineCurve(800.0, 0.5, strain_range, info.even));
    else if (info.name == "stretch_warp")
      set.components.push_back(splineCurve(1200.0, 0.3, strain_range, info.even));
    else if (info.name == "shear")
      set.components.push_back(splineCurve(60.0, 1.0, 2.0 * strain_range, info.even));
    else if (info.name == "poisson")
      set.components.push_back(constantCurve(100.0));
    else if (info.name == "cross_stiffening")
      set.components.push_back(constantCurve(300.0));
    else if (springs)
      set.components.push_back(splineCurve(40.0, 0.5, 0.02, info.even));
    else
      set.components.push_back(
          splineCurve(info.name == "bend_weft" ? 4e-6 : 3e-6, 1.0, 40.0, info.even));
  }
  return set;
}

/// Only the membrane's or only the bending's coefficients are free.
inline ParameterSet onlyFree(ParameterSet set, bool bending) {
  const std::size_t membrane = set.model->membrane_components.size();
  for (std::size_t i = 0; i < set.components.size(); ++i)
    if ((i >= membrane) != bending) set.components[i].basis = nullptr;
  return set;
}

/// Residuals with one coefficient moved by a share of itself.
inline Eigen::VectorXd movedResiduals(FitTest& test, const ParameterSet& at, int frame,
                                      Eigen::Index j, double share) {
  ParameterSet set = at;
  Eigen::VectorXd moved = at.coefficients();
  moved[j] *= 1.0 + share;
  set.setCoefficients(moved);
  test.setParameters(set);
  Eigen::VectorXd r;
  EXPECT_TRUE(test.evaluate(frame, r, nullptr).converged);
  return r;
}

/// Largest error of the Jacobian's columns, each times its coefficient, against central differences
/// of fourth order, relative to the largest entry of the column. Columns below a thousandth of the
/// largest one are compared with that floor.
/// @param share  step; small where strains lie near a curve's last knot, beyond which its
/// derivatives jump.
inline double jacobianError(FitTest& test, const ParameterSet& at, int frame, double share = 2e-3) {
  constexpr double kFloor = 1e-3;
  test.setParameters(at);
  Eigen::VectorXd r;
  Eigen::MatrixXd analytic;
  const FrameOutcome outcome = test.evaluate(frame, r, &analytic);
  EXPECT_TRUE(outcome.converged && outcome.stable) << outcome.problem;
  test.accept();
  EXPECT_EQ(analytic.rows(), r.size());
  EXPECT_EQ(analytic.cols(), at.size());
  analytic = analytic * at.coefficients().asDiagonal();
  const double largest = analytic.cwiseAbs().maxCoeff();
  EXPECT_GT(largest, 0.0) << "nothing moves: this proves nothing";
  double error = 0.0;
  for (Eigen::Index j = 0; j < at.size(); ++j) {
    const auto difference = [&](double step) {
      return Eigen::VectorXd(movedResiduals(test, at, frame, j, step) -
                             movedResiduals(test, at, frame, j, -step));
    };
    const Eigen::VectorXd numeric =
        (8.0 * difference(share) - difference(2.0 * share)) / (12.0 * share);
    const double scale = std::max(analytic.col(j).cwiseAbs().maxCoeff(), kFloor * largest);
    error = std::max(error, (numeric - analytic.col(j)).cwiseAbs().maxCoeff() / scale);
  }
  test.setParameters(at);
  return error;
}

/// Fourth-order differences of relative step 2e-3 leave (2e-3)^4 times a fifth derivative; the rest
/// is the equilibria's tolerance over the step.
inline constexpr double kJacobianTolerance = 1e-5;

}  // namespace tenter::kinds
