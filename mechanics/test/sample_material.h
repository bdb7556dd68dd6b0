// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tenter/mechanics/cloth_models.h"

namespace tenter::test_support {

/// Curves with several knots, and their bases, for every component of a model; constants where it
/// takes only those.
inline std::vector<ComponentCurve> sampleComponents(const ClothModel& model, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> draw(0.2, 1.0);
  std::vector<ComponentCurve> components;
  for (int i = 0; i < model.componentCount(); ++i) {
    const ComponentInfo& info = model.component(i);
    const double range = info.strain_unit == "1/m" ? 100.0 : 0.3;
    const double scale = info.stiffness_unit == "N m" ? 1e-5 : 500.0;
    const std::vector<double> knots =
        info.even ? std::vector{0.0, 0.4 * range, range}
                  : std::vector{-0.3 * range, 0.1 * range, 0.5 * range, range};
    ComponentCurve component;
    component.basis = std::make_shared<SplineBasis>(
        info.constant_only ? SplineBasis::constant() : SplineBasis::onKnots(knots, info.even));
    Eigen::VectorXd coefficients(component.basis->size());
    for (double& c : coefficients) c = scale * draw(random) * (info.may_be_negative ? 0.2 : 1.0);
    component.curve = component.basis->curve(coefficients);
    components.push_back(std::move(component));
  }
  return components;
}

/// A material with everything that a fit can leave in one.
inline Material sampleMaterial(const ClothModel& model, unsigned seed = 1) {
  const std::vector<ComponentCurve> curves = sampleComponents(model, seed);
  Material material;
  material.fabric = "knit-12";
  material.law = model.id;
  material.areal_density_kg_per_m2 = 0.1 + 1.0 / 3.0;
  material.thickness_m = 3.1e-4;
  material.mesh_pattern = "grid 25x25 uniform";
  material.bending_operator = "hinge-midedge";
  ParameterCovariance covariance;
  for (int i = 0; i < model.componentCount(); ++i) {
    MaterialComponent component;
    component.name = model.component(i).name;
    component.status = ComponentStatus::kFitted;
    component.curve = curves[i].curve;
    const Eigen::VectorXd c = curves[i].basis->coefficientsOf(component.curve);
    component.coefficients.assign(c.begin(), c.end());
    const auto knots = static_cast<std::size_t>(component.curve.knotCount());
    component.knot_std.assign(knots, 0.1 * component.curve.stiffnesses().front());
    component.knot_observed.assign(knots, true);
    if (knots > 1) {
      component.knot_std.back() = std::numeric_limits<double>::quiet_NaN();
      component.knot_observed.back() = false;
    }
    component.observed_min = component.curve.strains().front();
    component.observed_max = component.curve.strains().back() + 0.01;
    covariance.labels.push_back(component.name + "[0]");
    material.components.push_back(std::move(component));
  }
  const auto count = static_cast<Eigen::Index>(covariance.labels.size());
  covariance.covariance = Eigen::MatrixXd::Constant(count, count, 0.1);
  covariance.covariance.diagonal().setConstant(1.0 / 3.0);
  material.covariance = std::move(covariance);
  material.fit = {{"rms_N", 0.1 + 0.2}};
  material.provenance = {{"program", "tenter 0.1.0"}};
  return material;
}

}  // namespace tenter::test_support
