// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "material_format.h"
#include "tenter/core/files.h"

namespace tenter {
namespace {

using Json = nlohmann::json;

Json knotsToJson(const MaterialComponent& component) {
  const StiffnessCurve& curve = component.curve;
  const std::size_t count = curve.strains().size();
  require(component.knot_std.empty() || component.knot_std.size() == count,
          "knot_std has one entry a knot, or none");
  require(component.knot_observed.empty() || component.knot_observed.size() == count,
          "knot_observed has one entry a knot, or none");
  Json knots = Json::array();
  for (std::size_t i = 0; i < count; ++i) {
    Json knot = {{"strain", curve.strains()[i]},
                 {"stiffness", curve.stiffnesses()[i]},
                 {"tangent", curve.tangents()[i]}};
    if (!component.knot_std.empty()) {
      const double std = component.knot_std[i];
      knot["std"] = std::isnan(std) ? Json() : Json(std);
    }
    if (!component.knot_observed.empty()) knot["observed"] = bool{component.knot_observed[i]};
    knots.push_back(std::move(knot));
  }
  return knots;
}

std::string_view statusName(ComponentStatus status) {
  for (const auto& [value, name] : kStatusNames)
    if (value == status) return name;
  return kStatusNames.front().second;
}

Json componentToJson(const std::string& law, const MaterialComponent& component) {
  const ComponentInfo info = componentFormat(law, component.name);
  Json json = {{"name", component.name},
               {"status", statusName(component.status)},
               {"strain_measure", info.strain_measure},
               {"strain_unit", info.strain_unit},
               {"stiffness_unit", info.stiffness_unit},
               {"even", component.curve.even()},
               {"tangent_rule", "hermite"},
               {"knots", knotsToJson(component)},
               {"observed_strain", {component.observed_min, component.observed_max}}};
  if (!component.coefficients.empty()) json["coefficients"] = component.coefficients;
  return json;
}

Json covarianceToJson(const ParameterCovariance& covariance) {
  Json matrix = Json::array();
  for (int i = 0; i < covariance.covariance.rows(); ++i) {
    Json row = Json::array();
    for (int j = 0; j < covariance.covariance.cols(); ++j)
      row.push_back(covariance.covariance(i, j));
    matrix.push_back(std::move(row));
  }
  return {{"labels", covariance.labels}, {"matrix", std::move(matrix)}};
}

}  // namespace

Json materialToJson(const Material& material) {
  Json json = {{"schema_version", kMaterialSchemaVersion},
               {"fabric", material.fabric},
               {"law", material.law},
               {"variant", material.variant},
               {"areal_density_kg_per_m2", material.areal_density_kg_per_m2},
               {"thickness_m", material.thickness_m},
               {"mesh_pattern", material.mesh_pattern},
               {"bending_operator", material.bending_operator},
               {"components", Json::array()}};
  for (const MaterialComponent& component : material.components)
    json["components"].push_back(componentToJson(material.law, component));
  if (material.covariance) json["covariance"] = covarianceToJson(*material.covariance);
  if (!material.fit.is_null()) json["fit"] = material.fit;
  if (!material.provenance.is_null()) json["provenance"] = material.provenance;
  if (!material.tables.is_null()) json["tables"] = material.tables;
  return json;
}

Result<void> writeMaterial(const std::filesystem::path& file, const Material& material) {
  const Json json = materialToJson(material);
  // What could not be read again must not be written.
  if (const Result<Material> again = materialFromJson(json, file.string()); !again.ok())
    return again.error();
  try {
    return writeFileAtomically(file, json.dump(2) + "\n");
  } catch (const Json::exception&) {
    return badInput(file.string(), "", "a text in the material is not valid UTF-8");
  }
}

}  // namespace tenter
