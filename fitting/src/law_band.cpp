// SPDX-License-Identifier: GPL-3.0-or-later
#include "law_band.h"

#include <cmath>
#include <map>

namespace tenter {
namespace {

/// Component that a coefficient follows, and by which factor.
struct Tie {
  std::string component;
  double factor = 1.0;
};

Result<std::shared_ptr<const SplineBasis>> basisOf(const MaterialComponent& component, bool even) {
  if (component.coefficients.empty()) return std::shared_ptr<const SplineBasis>();
  const std::vector<double>& knots = component.curve.strains();
  auto basis = std::make_shared<const SplineBasis>(
      knots.size() > 1 ? SplineBasis::onKnots(knots, even) : SplineBasis::constant(even));
  if (basis->size() != static_cast<int>(component.coefficients.size()))
    return badInput("", "component " + component.name + ".coefficients",
                    "has " + std::to_string(component.coefficients.size()) +
                        " entries, its knots call for " + std::to_string(basis->size()));
  return std::shared_ptr<const SplineBasis>(std::move(basis));
}

/// What follows what, by the variant and by the fit's assumptions.
std::map<std::string, Tie> tiesOf(const Material& material) {
  std::map<std::string, Tie> ties;
  if (material.variant.find("isotropic") != std::string::npos) {
    ties["stretch_warp"] = {"stretch_weft", 1.0};
    ties["bend_warp"] = {"bend_weft", 1.0};
  }
  if (!material.fit.is_object() || !material.fit.contains("assumptions")) return ties;
  for (const nlohmann::json& entry : material.fit["assumptions"]) {
    const bool complete = entry.is_object() && entry.contains("component") &&
                          entry["component"].is_string() && entry.contains("follows") &&
                          entry["follows"].is_string() && entry.contains("factor") &&
                          entry["factor"].is_number();
    if (complete)
      ties[entry["component"].get<std::string>()] = {entry["follows"].get<std::string>(),
                                                     entry["factor"].get<double>()};
  }
  return ties;
}

}  // namespace

Result<std::optional<ParameterSet>> parametersOf(const Material& material,
                                                 const ClothModel& model) {
  // The laws' own reader knows what may be missing or foreign.
  if (const Result<ClothLaws> laws = makeLaws(model, material); !laws.ok()) return laws.error();
  if (!material.tables.is_null()) return std::optional<ParameterSet>();
  ParameterSet set;
  set.model = &model;
  for (int i = 0; i < model.componentCount(); ++i) {
    const MaterialComponent* component = material.find(std::string(model.component(i).name));
    if (!component) return std::optional<ParameterSet>();
    Result<std::shared_ptr<const SplineBasis>> basis = basisOf(*component, model.component(i).even);
    if (!basis) return basis.error();
    set.components.push_back({component->curve, *basis});
  }
  return std::optional<ParameterSet>(std::move(set));
}

Eigen::MatrixXd coefficientCovariance(const Material& material, const ParameterSet& parameters) {
  if (!material.covariance) return {};
  std::map<std::string, Eigen::Index> index;
  const std::vector<std::string>& labels = material.covariance->labels;
  for (std::size_t i = 0; i < labels.size(); ++i) index[labels[i]] = static_cast<Eigen::Index>(i);
  const std::map<std::string, Tie> ties = tiesOf(material);
  Eigen::MatrixXd by_label =
      Eigen::MatrixXd::Zero(parameters.size(), static_cast<Eigen::Index>(labels.size()));
  for (int c = 0; c < static_cast<int>(parameters.components.size()); ++c) {
    const std::string name(parameters.model->component(c).name);
    const int size = parameters.offset(c + 1) - parameters.offset(c);
    for (int j = 0; j < size; ++j) {
      const std::string place = "[" + std::to_string(j) + "]";
      const auto tie = ties.find(name);
      if (const auto own = index.find(name + place); own != index.end())
        by_label(parameters.offset(c) + j, own->second) = 1.0;
      else if (tie != ties.end() && index.contains(tie->second.component + place))
        by_label(parameters.offset(c) + j, index[tie->second.component + place]) =
            tie->second.factor;
    }
  }
  return by_label * material.covariance->covariance * by_label.transpose();
}

Result<std::vector<Material>> alternativeLaws(const Material& material) {
  std::vector<Material> laws;
  if (!material.fit.is_object() || !material.fit.contains("law_uncertainty")) return laws;
  const nlohmann::json& uncertainty = material.fit["law_uncertainty"];
  if (!uncertainty.is_object()) return laws;
  std::vector<nlohmann::json> entries;
  if (uncertainty.contains("alternative")) entries.push_back(uncertainty["alternative"]);
  if (uncertainty.contains("alternatives") && uncertainty["alternatives"].is_array())
    for (const nlohmann::json& entry : uncertainty["alternatives"]) entries.push_back(entry);
  for (const nlohmann::json& entry : entries) {
    const bool wrapped = entry.is_object() && entry.contains("material");
    Result<Material> law = materialFromJson(wrapped ? entry["material"] : entry, "");
    if (!law) {
      Error error = law.error();
      error.place = "fit.law_uncertainty: " + error.place;
      return error;
    }
    laws.push_back(std::move(*law));
  }
  return laws;
}

double comparableResidual(const Material& material, const std::string& protocol) {
  if (!material.fit.is_object() || !material.fit.contains("tests") ||
      !material.fit["tests"].is_array())
    return 0.0;
  double sum = 0.0;
  int count = 0;
  for (const nlohmann::json& test : material.fit["tests"]) {
    const bool comparable = test.is_object() && test.contains("protocol") &&
                            test["protocol"] == protocol && test.contains("force_nrmse") &&
                            test["force_nrmse"].is_number();
    if (!comparable) continue;
    const double nrmse = test["force_nrmse"].get<double>();
    sum += nrmse * nrmse;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0.0;
}

}  // namespace tenter
