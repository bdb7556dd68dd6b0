// SPDX-License-Identifier: GPL-3.0-or-later
#include "arcsim_law.h"
#include "import_table.h"
#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"
#include "tenter/fitting/import.h"

namespace tenter {

namespace {

using import::shown;

/// Why [c11 c12; c12 c22] + c33 is not positive definite; empty if it is.
std::string stretchComplaint(const Eigen::Ref<const Eigen::RowVector4d>& row) {
  const double c11 = row[0], c12 = row[1], c22 = row[2], c33 = row[3];
  if (c11 <= 0.0) return "c11 = " + shown(c11) + " is not positive";
  if (c22 <= 0.0) return "c22 = " + shown(c22) + " is not positive";
  if (c11 * c22 <= c12 * c12) {
    return "c11 c22 = " + shown(c11 * c22) + " does not exceed c12^2 = " + shown(c12 * c12);
  }
  if (c33 <= 0.0) return "c33 = " + shown(c33) + " is not positive";
  return "";
}

std::string bendComplaint(const Eigen::Ref<const Eigen::RowVectorXd>& row) {
  for (Eigen::Index i = 0; i < row.size(); ++i) {
    if (row[i] <= 0.0) {
      return "entry " + std::to_string(i) + " = " + shown(row[i]) + " is not positive";
    }
  }
  return "";
}

std::vector<FlaggedRow> flag(const arcsim::Tables& tables) {
  std::vector<FlaggedRow> flagged;
  const auto add = [&](const char* table, int row, const std::string& reason) {
    if (!reason.empty()) flagged.push_back({table, row, reason});
  };
  for (int r = 0; r < arcsim::kStretchRows; ++r) {
    add("stretching", r, stretchComplaint(tables.stretching.row(r)));
  }
  for (int r = 0; r < arcsim::kBendRows; ++r)
    add("bending", r, bendComplaint(tables.bending.row(r)));
  return flagged;
}

}  // namespace

Result<std::vector<FlaggedRow>> flagArcsimRows(const Material& material) {
  const auto tables = arcsim::tablesFromJson(material.tables, "", "tables");
  if (!tables) return tables.error();
  return flag(*tables);
}

Result<ImportedMaterial> importArcsim(const std::filesystem::path& file,
                                      const std::string& fabric) {
  const auto json = readJsonFile(file);
  if (!json) return json.error();
  const auto tables = arcsim::tablesFromJson(*json, file.string(), "");
  if (!tables) return tables.error();
  const auto hash = sha256OfPath(file);
  if (!hash) return hash.error();

  ImportedMaterial imported;
  imported.flagged = flag(*tables);
  Material& material = imported.material;
  material.fabric = fabric.empty() ? file.stem().string() : fabric;
  material.law = "arcsim";
  material.areal_density_kg_per_m2 = tables->density_kg_per_m2;
  material.tables = *json;  // the numbers as they stand, and whatever else the file holds
  material.provenance = {
      {"imported_from",
       {{"file", file.filename().string()}, {"sha256", *hash}, {"kind", "arcsim"}}}};
  return imported;
}

}  // namespace tenter
