// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <string_view>

#include "import_table.h"
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
constexpr std::size_t kMaxFabrics = 1000;

/// What a table must hold, its unit, and the largest value that cloth can have.
struct Property {
  std::string_view name, unit;
  bool required;
  double min, max;
};
constexpr Property kProperties[] = {
    {"EMT", "%", true, 0.05, 200.0},        {"LT", "-", true, 0.51, 1.5},
    {"WT", "gf.cm/cm2", false, 0.0, 1e4},   {"RT", "%", false, 0.0, 120.0},
    {"B", "gf.cm2/cm", true, 1e-4, 100.0},  {"2HB", "gf.cm/cm", false, 0.0, 100.0},
    {"G", "gf/cm/deg", true, 1e-3, 1000.0}, {"2HG", "gf/cm", false, 0.0, 1000.0},
    {"2HG5", "gf/cm", false, 0.0, 1000.0},
};

using Row = std::map<std::string, double, std::less<>>;

struct KesTable {
  std::string file;
  std::vector<std::string> fabrics;
  std::vector<Row> columns;  ///< One a fabric: property to value.
};

std::vector<std::string> cellsOf(std::string_view line) {
  std::vector<std::string> cells;
  while (true) {
    const auto end = line.find(',');
    const std::string_view cell = line.substr(0, end);
    const auto first = cell.find_first_not_of(" \t\r");
    const auto last = cell.find_last_not_of(" \t\r");
    cells.emplace_back(first == std::string_view::npos ? "" : cell.substr(first, last - first + 1));
    if (end == std::string_view::npos) return cells;
    line.remove_prefix(end + 1);
  }
}

const Property* findProperty(const std::string& name) {
  for (const Property& property : kProperties) {
    if (property.name == name) return &property;
  }
  return nullptr;
}

bool nameIsSafe(const std::string& name) {
  const bool letters = name.find_first_not_of(
                           "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                           "0123456789_-. ") == std::string::npos;
  return letters && !name.empty() && name.size() <= 64 && name.front() != '.';
}

Result<void> readHeader(const std::vector<std::string>& cells, const std::string& place,
                        KesTable& table) {
  if (cells.size() < 3 || cells[0] != "property" || cells[1] != "unit") {
    return badInput(table.file, place, "is not the header of a KES table",
                    "begin with: property,unit, and one column a fabric");
  }
  table.fabrics.assign(cells.begin() + 2, cells.end());
  if (table.fabrics.size() > kMaxFabrics)
    return badInput(table.file, place, "has too many columns");
  for (std::size_t i = 0; i < table.fabrics.size(); ++i) {
    const std::string& name = table.fabrics[i];
    if (!nameIsSafe(name)) {
      return badInput(table.file, place, "\"" + name.substr(0, 40) + "\" cannot name a fabric",
                      "use letters, digits, - and _");
    }
    if (std::find(table.fabrics.begin(), table.fabrics.begin() + static_cast<std::ptrdiff_t>(i),
                  name) != table.fabrics.begin() + static_cast<std::ptrdiff_t>(i)) {
      return badInput(table.file, place, "the fabric " + name + " appears twice");
    }
  }
  table.columns.resize(table.fabrics.size());
  return {};
}

Result<void> readProperty(const std::vector<std::string>& cells, const std::string& place,
                          KesTable& table) {
  const Property* property = findProperty(cells[0]);
  if (property == nullptr) return {};  // tables hold more than a material needs
  if (cells.size() != table.fabrics.size() + 2) {
    return badInput(table.file, place,
                    "has " + std::to_string(cells.size()) + " columns instead of " +
                        std::to_string(table.fabrics.size() + 2));
  }
  if (cells[1] != property->unit) {
    return badInput(table.file, place,
                    cells[0] + " is in \"" + cells[1].substr(0, 40) + "\" but must be in \"" +
                        std::string(property->unit) + "\"");
  }
  for (std::size_t i = 0; i < table.fabrics.size(); ++i) {
    const std::string& cell = cells[i + 2];
    const std::string at = place + ", fabric " + table.fabrics[i];
    double value = 0.0;
    const auto [end, code] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (code != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value)) {
      return badInput(table.file, at, "\"" + cell.substr(0, 40) + "\" is not a finite number");
    }
    if (value < property->min || value > property->max) {
      return badInput(table.file, at,
                      cells[0] + " is " + shown(value) + ", outside " + shown(property->min) +
                          " to " + shown(property->max) + " " + std::string(property->unit),
                      "check the unit");
    }
    if (!table.columns[i].emplace(cells[0], value).second) {
      return badInput(table.file, place, cells[0] + " appears twice");
    }
  }
  return {};
}

Result<KesTable> readKes(const std::filesystem::path& csv) {
  const auto content = readFile(csv);
  if (!content) return content.error();
  KesTable table{csv.string(), {}, {}};
  std::string_view rest = *content;
  for (int number = 1; !rest.empty(); ++number) {
    const auto end = rest.find('\n');
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (line.find_first_not_of(" \t\r") == std::string_view::npos || line.front() == '#') continue;
    const auto cells = cellsOf(line);
    const std::string place = "line " + std::to_string(number);
    const auto ok =
        table.fabrics.empty() ? readHeader(cells, place, table) : readProperty(cells, place, table);
    if (!ok) return ok.error();
  }
  if (table.fabrics.empty()) return badInput(table.file, "", "holds no KES table");
  for (const Property& property : kProperties) {
    if (property.required && !table.columns.front().contains(property.name)) {
      return badInput(table.file, "", std::string(property.name) + " is missing",
                      "EMT, LT, G and B are needed");
    }
  }
  return table;
}

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

ImportedMaterial materialOf(const std::string& fabric, int column, const Row& row, double density) {
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

nlohmann::json provenanceOf(const Row& row, const std::string& file, const std::string& hash) {
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
  const auto table = readKes(csv);
  if (!table) return table.error();
  const auto hash = sha256OfPath(csv);
  if (!hash) return hash.error();
  std::vector<ImportedMaterial> materials;
  for (std::size_t i = 0; i < table->fabrics.size(); ++i) {
    if (options.fabric && *options.fabric != table->fabrics[i]) continue;
    materials.push_back(materialOf(table->fabrics[i], static_cast<int>(i), table->columns[i],
                                   options.areal_density_kg_per_m2));
    materials.back().material.provenance =
        provenanceOf(table->columns[i], csv.filename().string(), *hash);
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
