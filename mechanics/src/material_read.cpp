// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <limits>

#include "material_format.h"
#include "tenter/core/json_reader.h"

namespace tenter {
namespace {

using Json = nlohmann::json;
using Range = JsonReader::Range;

constexpr std::size_t kMaxComponents = 64;
constexpr std::size_t kMaxKnots = 10000;
constexpr std::size_t kMaxParameters = 4096;
constexpr std::size_t kMaxNameLength = 64;

/// No cloth comes near these; what passes them is another unit.
constexpr double kMaxArealDensity_kg_per_m2 = 50.0;
constexpr double kMaxThickness_m = 0.1;
constexpr double kMaxStrain = 10.0, kMaxCurvature_per_m = 1e6;
constexpr double kMaxMembrane_N_per_m = 1e9, kMaxBending_N_m = 1e4;

/// Stiffness that the coefficients and the knots may differ by, relative to the largest: both are
/// written losslessly and differ by the rounding of one evaluation.
constexpr double kCoefficientTolerance = 1e-9;
/// |cov_ij| may pass sqrt(cov_ii cov_jj) by rounding only; so may cov_ij differ from cov_ji.
constexpr double kCovarianceTolerance = 1e-6;

bool given(const JsonReader& in, const std::string& key) {
  return in.has(key) && !in.json().at(key).is_null();
}

Json freeForm(const JsonReader& in, const std::string& key) {
  return given(in, key) ? in.json().at(key) : Json();
}

void expectText(JsonReader& in, const std::string& key, std::string_view expected) {
  const std::string text = in.text(key);
  if (in.ok() && text != expected)
    in.fail(key, "is '" + text + "' but must be '" + std::string(expected) + "'",
            "material files are in SI units");
}

struct Knots {
  std::vector<double> strain, stiffness, tangent, std;
  std::vector<bool> observed;
};

/// Errors name the knot; `std` and `observed` stand at every knot or at none.
Knots readKnots(JsonReader& in, const ComponentInfo& info) {
  const bool curvature = info.strain_unit == "1/m";
  const double max_strain = curvature ? kMaxCurvature_per_m : kMaxStrain;
  const double max_stiffness =
      info.stiffness_unit == "N m" ? kMaxBending_N_m : kMaxMembrane_N_per_m;
  Knots knots;
  const std::size_t count = in.arraySize("knots");
  if (count == 0 || count > kMaxKnots)
    in.fail("knots", "must hold 1 to " + std::to_string(kMaxKnots) + " knots");
  for (std::size_t i = 0; i < count && in.ok(); ++i) {
    JsonReader knot = in.element("knots", i);
    knots.strain.push_back(knot.number("strain", Range::between(-max_strain, max_strain)));
    knots.stiffness.push_back(
        knot.number("stiffness", Range::between(-max_stiffness, max_stiffness)));
    knots.tangent.push_back(knot.number("tangent"));
    if (knot.has("std"))
      knots.std.push_back(given(knot, "std") ? knot.number("std", Range::nonNegative())
                                             : std::numeric_limits<double>::quiet_NaN());
    if (knot.has("observed")) knots.observed.push_back(knot.boolean("observed"));
    if (!knots.std.empty() && knots.std.size() != i + 1)
      knot.fail("std", "is given at some knots only", "use null where it is not known");
    if (!knots.observed.empty() && knots.observed.size() != i + 1)
      knot.fail("observed", "is given at some knots only");
  }
  return knots;
}

void checkCoefficients(JsonReader& in, const MaterialComponent& component) {
  const StiffnessCurve& curve = component.curve;
  const bool single = curve.knotCount() == 1;
  const SplineBasis basis = single ? SplineBasis::constant(curve.even())
                                   : SplineBasis::onKnots(curve.strains(), curve.even());
  if (static_cast<int>(component.coefficients.size()) != basis.size())
    return in.fail("coefficients", "has " + std::to_string(component.coefficients.size()) +
                                       " numbers, but these knots need " +
                                       std::to_string(basis.size()));
  const Eigen::VectorXd coefficients = Eigen::Map<const Eigen::VectorXd>(
      component.coefficients.data(), static_cast<Eigen::Index>(component.coefficients.size()));
  const double largest = std::max(coefficients.cwiseAbs().maxCoeff(), 1e-300);
  const Eigen::VectorXd values = basis.knotValueMap() * coefficients;
  for (int i = 0; i < values.size(); ++i)
    if (!(std::abs(values[i] - curve.stiffnesses()[i]) <= kCoefficientTolerance * largest))
      return in.fail("coefficients", "contradict the stiffness of knot " + std::to_string(i));
}

ComponentStatus readStatus(JsonReader& in) {
  const std::string text = in.text("status", kMaxNameLength);
  for (const auto& [status, name] : kStatusNames)
    if (name == text) return status;
  in.fail("status", "is '" + text + "' but must be fitted, assumed or unobserved");
  return ComponentStatus::kUnobserved;
}

MaterialComponent readComponent(JsonReader in, const std::string& law) {
  MaterialComponent component;
  component.name = in.text("name", kMaxNameLength);
  if (component.name.empty()) in.fail("name", "is empty");
  const Result<const ClothModel*> model = findClothModel(law);
  if (model.ok() && (*model)->componentIndex(component.name) < 0)
    in.fail("name", "is '" + component.name + "', which law " + law + " does not have");
  component.status = readStatus(in);
  const ComponentInfo info = componentFormat(law, component.name);
  in.text("strain_measure");
  expectText(in, "strain_unit", info.strain_unit);
  expectText(in, "stiffness_unit", info.stiffness_unit);
  expectText(in, "tangent_rule", "hermite");
  const bool even = in.boolean("even");

  Knots knots = readKnots(in, info);
  if (!in.ok()) return component;
  Result<StiffnessCurve> curve = StiffnessCurve::fromKnots(
      std::move(knots.strain), std::move(knots.stiffness), std::move(knots.tangent), even);
  if (!curve.ok()) {
    const Error& error = curve.error();
    in.fail("knots", error.place.empty() ? error.reason : error.place + ": " + error.reason);
    return component;
  }
  component.curve = std::move(curve).value();
  component.knot_std = std::move(knots.std);
  component.knot_observed = std::move(knots.observed);
  if (given(in, "coefficients")) {
    component.coefficients = in.numbers("coefficients");
    if (in.ok() && !component.coefficients.empty()) checkCoefficients(in, component);
  }
  if (given(in, "observed_strain")) {
    const Eigen::VectorXd range = in.vector("observed_strain", 2);
    if (range[0] > range[1]) in.fail("observed_strain", "ends before it begins");
    component.observed_min = range[0];
    component.observed_max = range[1];
  }
  return component;
}

/// "stretch_weft[3]" is a coefficient of a component that is there.
bool labelFits(const Material& material, const std::string& label) {
  const std::size_t bracket = label.find('[');
  if (bracket == std::string::npos || label.back() != ']') return false;
  const MaterialComponent* component = material.find(label.substr(0, bracket));
  if (component == nullptr) return false;
  const std::string digits = label.substr(bracket + 1, label.size() - bracket - 2);
  if (digits.empty() || digits.size() > 5 ||
      !std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; }))
    return false;
  return component->coefficients.empty() || std::stoul(digits) < component->coefficients.size();
}

void checkMatrix(JsonReader& in, const Eigen::MatrixXd& c) {
  for (int i = 0; i < c.rows(); ++i)
    if (c(i, i) < 0.0)
      return in.fail("matrix[" + std::to_string(i) + "][" + std::to_string(i) + "]",
                     "is a negative variance");
  for (int i = 0; i < c.rows(); ++i)
    for (int j = 0; j < i; ++j) {
      const double bound = std::sqrt(std::max(c(i, i), 0.0)) * std::sqrt(std::max(c(j, j), 0.0));
      const std::string place = "matrix[" + std::to_string(i) + "][" + std::to_string(j) + "]";
      if (std::abs(c(i, j) - c(j, i)) > kCovarianceTolerance * bound)
        return in.fail(place, "differs from its mirror image");
      if (std::abs(c(i, j)) > (1.0 + kCovarianceTolerance) * bound)
        return in.fail(place, "means a correlation beyond 1");
    }
}

ParameterCovariance readCovariance(JsonReader in, const Material& material) {
  ParameterCovariance covariance;
  covariance.labels = in.texts("labels");
  if (covariance.labels.size() > kMaxParameters) in.fail("labels", "has too many entries");
  for (std::size_t i = 0; i < covariance.labels.size() && in.ok(); ++i)
    if (!labelFits(material, covariance.labels[i]))
      in.fail("labels[" + std::to_string(i) + "]",
              "is '" + covariance.labels[i] + "', which is no coefficient of a component here");
  if (!in.ok()) return covariance;
  const int count = static_cast<int>(covariance.labels.size());
  covariance.covariance = in.matrix("matrix", count, count);
  if (in.ok()) checkMatrix(in, covariance.covariance);
  return covariance;
}

void readComponents(JsonReader& in, Material& material) {
  const std::size_t count = in.arraySize("components");
  if (count > kMaxComponents) in.fail("components", "has too many entries");
  for (std::size_t i = 0; i < count && in.ok(); ++i) {
    MaterialComponent component = readComponent(in.element("components", i), material.law);
    if (in.ok() && material.find(component.name) != nullptr)
      in.fail("components[" + std::to_string(i) + "].name",
              "is '" + component.name + "', which came before");
    material.components.push_back(std::move(component));
  }
}

Material readHead(JsonReader& in) {
  Material material;
  if (in.integer("schema_version", 1, 1000000) > kMaterialSchemaVersion)
    in.fail("schema_version", "is newer than this program knows", "use a newer tenter");
  material.fabric = in.text("fabric");
  material.law = in.text("law", kMaxNameLength);
  if (in.ok() && !isTabulatedLaw(material.law) && !findClothModel(material.law).ok())
    in.fail("law", "is '" + material.law + "', which is unknown", "there are: " + knownLaws());
  material.variant = in.textOr("variant", "orthotropic");
  if (std::find(kMaterialVariants.begin(), kMaterialVariants.end(), material.variant) ==
      kMaterialVariants.end())
    in.fail("variant", "is '" + material.variant + "', which is unknown",
            "orthotropic, linear, isotropic or linear-isotropic");
  material.areal_density_kg_per_m2 =
      in.number("areal_density_kg_per_m2", Range::nonNegative(kMaxArealDensity_kg_per_m2));
  material.thickness_m = in.numberOr("thickness_m", 0.0, Range::nonNegative(kMaxThickness_m));
  material.mesh_pattern = in.textOr("mesh_pattern", "");
  material.bending_operator = in.textOr("bending_operator", "");
  return material;
}

}  // namespace

Result<Material> materialFromJson(const Json& json, const std::string& file) {
  JsonReader in(json, file);
  Material material = readHead(in);
  if (!in.ok()) return in.error();
  readComponents(in, material);
  material.fit = freeForm(in, "fit");
  material.provenance = freeForm(in, "provenance");
  material.tables = freeForm(in, "tables");
  const bool tabulated = isTabulatedLaw(material.law);
  if (tabulated && !material.tables.is_object())
    in.fail("tables", "must be an object: the law " + material.law + " is made of tables");
  if (!tabulated && !material.tables.is_null())
    in.fail("tables", "belongs to tabulated laws, which " + material.law + " is not");
  if (!in.ok()) return in.error();
  if (!tabulated) {
    const Result<ClothLaws> laws = makeLaws(**findClothModel(material.law), material);
    if (!laws.ok()) return laws.error().in(file);
  }
  if (in.ok() && given(in, "covariance"))
    material.covariance = readCovariance(in.object("covariance"), material);
  if (!in.ok()) return in.error();
  return material;
}

Result<Material> readMaterial(const std::filesystem::path& file) {
  const Result<Json> json = readJsonFile(file);
  if (!json.ok()) return json.error();
  return materialFromJson(*json, file.string());
}

}  // namespace tenter
