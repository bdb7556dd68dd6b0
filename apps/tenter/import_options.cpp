// SPDX-License-Identifier: GPL-3.0-or-later
#include "import_options.h"

namespace tenter::app {

SpecimenInfo SpecimenOptions::inSi() const {
  SpecimenInfo si = info;
  si.thickness_m = kMetresPerMm * thickness_mm;
  return si;
}

void declareSpecimen(CLI::App& command, SpecimenOptions& o) {
  command.add_option("--areal-density-kg-m2", o.info.areal_density_kg_per_m2, "Mass per area")
      ->required();
  command.add_option("--thickness-mm", o.thickness_mm, "Thickness; 0 if not known");
  command.add_option("--fabric", o.info.fabric, "Name of the fabric");
  command.add_option("--specimen", o.info.specimen, "Which piece of it; repeats share the name");
  command.add_option("-o,--output", o.output, "Folder of the measurement")->required();
}

Result<int> finishMeasurement(const Measurement& measurement, const std::string& folder,
                              Console& console) {
  if (auto done = writeMeasurement(folder, measurement); !done) return done.error();
  console.answer["measurement"] = folder;
  console.answer["protocol"] = measurement.protocol;
  console.answer["frames"] = measurement.frames.size();
  console.say(folder + ": " + counted(measurement.frames.size(), "frame"));
  return kDone;
}

nlohmann::json flaggedToJson(const std::vector<FlaggedRow>& flagged) {
  auto rows = nlohmann::json::array();
  for (const FlaggedRow& row : flagged) {
    rows.push_back({{"table", row.table}, {"row", row.row}, {"reason", row.reason}});
  }
  return rows;
}

void warnFlagged(const std::vector<FlaggedRow>& flagged, const Console& console) {
  for (const FlaggedRow& row : flagged) {
    console.warn(row.table + ", row " + std::to_string(row.row) + ": " + row.reason);
  }
}

}  // namespace tenter::app
