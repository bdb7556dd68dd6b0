// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <numbers>

#include "import_table.h"
#include "kes_table.h"
#include "tenter/core/files.h"
#include "tenter/fitting/import.h"

namespace tenter {

namespace {

using import::shown;

constexpr double kGravity_m_per_s2 = kStandardGravity_m_per_s2;
constexpr double kMaxForce_N_per_m = 500e-3 * kGravity_m_per_s2 / 1e-2;  // 500 gf/cm
constexpr double kShear_N_per_m = 1e-3 * kGravity_m_per_s2 / 1e-2 * 180.0 / std::numbers::pi;
constexpr double kBend_N_m = 1e-3 * kGravity_m_per_s2 * 1e-2;       // gf cm^2/cm
constexpr double kForce_N_per_m = 1e-3 * kGravity_m_per_s2 / 1e-2;  // gf/cm
constexpr double kMoment_N = 1e-3 * kGravity_m_per_s2;              // gf cm/cm
constexpr double kWorkTolerance = 0.02;  // EMT, LT and WT are printed with three digits
constexpr double kShearSlopeEnd_rad = 2.5 * std::numbers::pi / 180.0;
constexpr double kBendFrom_per_m = 50.0, kBendTo_per_m = 150.0;
/// Tension F(e) = k0 e + k2 e^3 through F(EMT) = 500 gf/cm with the linearity LT.
StiffnessCurve tensileCurve(double emt, double linearity) {
  const double secant = kMaxForce_N_per_m / emt;
  const double k0 = (2.0 * linearity - 1.0) * secant;
  const double k2 = (2.0 - 2.0 * linearity) * secant / (emt * emt);
  const auto k = [&](double e) { return k0 + k2 * e * e; };
  return StiffnessCurve::fromKnots({0.0, 0.5 * emt, emt}, {k(0.0), k(0.5 * emt), k(emt)},
                                   {0.0, k2 * emt, 2.0 * k2 * emt})
      .value();
}

void add(Material& material, const std::string& name, ComponentStatus status,
         const StiffnessCurve& curve, double from, double to) {
  MaterialComponent component;
  component.name = name;
  component.status = status;
  component.curve = curve;
  component.observed_min = from;
  component.observed_max = to;
  material.components.push_back(std::move(component));
}

ImportedMaterial materialOf(const std::string& fabric, int column, const KesResults& row,
                            double density) {
  ImportedMaterial imported;
  const double emt = row.at("EMT") / 100.0, linearity = row.at("LT");
  const double implied = linearity * 0.5 * 500.0 * emt;
  const auto work = row.find("WT");
  if (work != row.end() && std::abs(work->second - implied) > kWorkTolerance * implied) {
    imported.flagged.push_back({"WT", column,
                                "fabric " + fabric + ": WT = " + shown(work->second) +
                                    " gf cm/cm^2, but LT = " + shown(linearity) +
                                    " and EMT = " + shown(row.at("EMT")) + " % imply " +
                                    shown(implied) + "; LT and EMT were used"});
  }
  Material& m = imported.material;
  m.fabric = fabric;
  m.law = "soft";
  m.variant = "isotropic";
  m.areal_density_kg_per_m2 = density;
  const auto fitted = ComponentStatus::kFitted;
  const StiffnessCurve stretch = tensileCurve(emt, linearity);
  add(m, "stretch_weft", fitted, stretch, 0.0, emt);
  add(m, "stretch_warp", fitted, stretch, 0.0, emt);
  add(m, "shear", fitted, StiffnessCurve::constant(row.at("G") * kShear_N_per_m, true), 0.0,
      std::tan(kShearSlopeEnd_rad));
  const double rigidity = row.at("B") * kBend_N_m;
  add(m, "bend_weft", fitted, StiffnessCurve::constant(rigidity, true), kBendFrom_per_m,
      kBendTo_per_m);
  add(m, "bend_warp", fitted, StiffnessCurve::constant(rigidity, true), kBendFrom_per_m,
      kBendTo_per_m);
  // Half of B makes the rigidity the same in every direction: B(45) = (B + B) / 4 + B_d.
  add(m, "bend_diagonal", ComponentStatus::kAssumed, StiffnessCurve::constant(0.5 * rigidity, true),
      0.0, 0.0);
  return imported;
}

nlohmann::json provenanceOf(const KesResults& row, const std::string& file,
                            const std::string& hash) {
  nlohmann::json kes = nlohmann::json::object();
  for (const auto& [name, value] : row) kes[name] = value;
  nlohmann::json si = nlohmann::json::object();
  const auto convert = [&](const char* name, const char* key, double factor) {
    if (const auto found = row.find(name); found != row.end()) si[key] = factor * found->second;
  };
  convert("2HB", "bending_hysteresis_N", kMoment_N);
  convert("2HG", "shear_hysteresis_0.5_deg_N_per_m", kForce_N_per_m);
  convert("2HG5", "shear_hysteresis_5_deg_N_per_m", kForce_N_per_m);
  convert("RT", "tensile_resilience", 0.01);
  return {{"imported_from", {{"file", file}, {"sha256", hash}, {"kind", "kes"}}},
          {"kes_fb", kes},
          {"si", si}};
}

}  // namespace

Result<std::vector<ImportedMaterial>> importKes(const std::filesystem::path& csv,
                                                const KesImportOptions& options) {
  const auto table = readKesTable(csv);
  if (!table) return table.error();
  const auto hash = sha256OfPath(csv);
  if (!hash) return hash.error();
  std::vector<ImportedMaterial> materials;
  for (std::size_t i = 0; i < table->fabrics.size(); ++i) {
    if (options.fabric && *options.fabric != table->fabrics[i]) continue;
    materials.push_back(materialOf(table->fabrics[i], static_cast<int>(i), table->results[i],
                                   options.areal_density_kg_per_m2));
    materials.back().material.provenance =
        provenanceOf(table->results[i], csv.filename().string(), *hash);
  }
  if (materials.empty()) {
    std::string names;
    for (const std::string& name : table->fabrics) names += " " + name;
    return badInput(table->file, "--fabric", "no column is called " + *options.fabric,
                    "there are:" + names);
  }
  return materials;
}

}  // namespace tenter
