// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/mechanics/stiffness_curve.h"

namespace tenter {

inline constexpr int kMaterialSchemaVersion = 1;

/// How a component's numbers came about.
enum class ComponentStatus {
  kFitted,      ///< Seen by measurements.
  kAssumed,     ///< Given by the user or a stated rule.
  kUnobserved,  ///< The fit had it, but no measurement moves with it: the value is a regularised
                ///< guess.
};

/// One named stiffness of a law, e.g. "stretch_weft" or "bend_diagonal".
struct MaterialComponent {
  std::string name;
  ComponentStatus status = ComponentStatus::kAssumed;
  StiffnessCurve curve = StiffnessCurve::constant(0.0);
  std::vector<double> coefficients;  ///< B-spline coefficients behind the curve (SplineBasis);
                                     ///< empty if it is not one of those.
  std::vector<double>
      knot_std;  ///< Standard deviation of k at each knot; NaN where unobserved; empty if unknown.
  std::vector<bool> knot_observed;  ///< Whether measurements see k there; empty if unknown.
  double observed_min = 0.0;        ///< Strains that the measurements reached, outliers left out.
  double observed_max = 0.0;
};

/// Covariance of the fitted parameters, in the order of `labels` ("stretch_weft[3]": coefficient
/// 3).
struct ParameterCovariance {
  std::vector<std::string> labels;
  Eigen::MatrixXd covariance;  ///< Units of the coefficients; zero rows where unobserved.
};

/// A material as the file holds it (docs/formats/material.md). The law id names a row of the cloth
/// model registry.
struct Material {
  std::string fabric;
  std::string law;  ///< "springs", "soft", "stvk", "stvk-coupled", "edge-hinge", "arcsim" ...
  std::string variant = "orthotropic";  ///< Or "linear", "isotropic", "linear-isotropic".
  double areal_density_kg_per_m2 = 0.0;
  double thickness_m = 0.0;  ///< 0 if not known.
  std::vector<MaterialComponent> components;
  std::string mesh_pattern;      ///< Mesh that it was fitted on, e.g. "grid 25x25 uniform"; springs
                                 ///< mean nothing without it.
  std::string bending_operator;  ///< e.g. "hinge-midedge".
  std::optional<ParameterCovariance> covariance;
  nlohmann::json fit;         ///< Residuals per test, held-out residuals, identifiability, law
                              ///< uncertainty; free form, null if none.
  nlohmann::json provenance;  ///< Hash of each measurement, program version, options; null if none.
  nlohmann::json tables;      ///< Tabulated laws (imported): their own numbers; null otherwise.

  const MaterialComponent* find(const std::string& name) const;
  MaterialComponent* find(const std::string& name);
};

/// Lossless: doubles survive a round trip bit for bit.
Result<Material> readMaterial(const std::filesystem::path& file);
Result<Material> materialFromJson(const nlohmann::json& json, const std::string& file);
nlohmann::json materialToJson(const Material& material);
Result<void> writeMaterial(const std::filesystem::path& file, const Material& material);

/// One finding of `tenter material check`.
struct MaterialFinding {
  enum class Severity { kError, kWarning, kNote } severity;
  std::string component;
  std::string text;
};

/// Negative stiffness anywhere in the range (error), d(k e)/de < 0 (warning, with the interval),
/// coupling that makes the tangent indefinite, unobserved components, use beyond the measured
/// range, missing density.
std::vector<MaterialFinding> checkMaterial(const Material& material);

}  // namespace tenter
