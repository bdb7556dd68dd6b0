// SPDX-License-Identifier: GPL-3.0-or-later
#include "import_options.h"
#include "output_guard.h"
#include "tenter/core/files.h"
#include "verbs.h"

namespace tenter::app {

namespace {

const FolderKind& materialsFolder() {
  static const FolderKind kKind{"import.json", "\"kind\": \"kes\"", {"*.json"}};
  return kKind;
}

struct Options {
  std::string csv, output;
  std::string fabric;
  double areal_density_kg_per_m2 = 0.0;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("csv", o.csv, "Table with one column a fabric: property,unit,A,B...")
      ->required();
  command.add_option("--fabric", o.fabric, "One column only; -o is then a material file");
  command
      .add_option("--areal-density-kg-m2", o.areal_density_kg_per_m2,
                  "Mass per area, which the table lacks")
      ->check(CLI::Range(0.0, 5.0));
  command
      .add_option("-o,--output", o.output,
                  "Folder for one material a fabric; with --fabric a material file")
      ->required();
}

Result<void> writeFolder(const Options& o, const std::vector<ImportedMaterial>& materials) {
  return writeFolderAtomically(
      o.output, materialsFolder(), [&](const std::filesystem::path& folder) -> Result<void> {
        auto files = nlohmann::json::array();
        for (const ImportedMaterial& m : materials) {
          const std::string name = m.material.fabric + ".json";
          if (auto done = writeMaterial(folder / name, m.material); !done) return done;
          files.push_back({{"file", name}, {"flagged", flaggedToJson(m.flagged)}});
        }
        const nlohmann::json index = {{"kind", "kes"}, {"materials", files}};
        return writeFileAtomically(folder / materialsFolder().marker, index.dump(2) + "\n");
      });
}

Result<int> run(const Options& o, Console& console) {
  const bool single = !o.fabric.empty();
  const auto free =
      single ? checkMaterialOutput(o.output) : checkOutputFolder(o.output, materialsFolder());
  if (!free) return free.error();
  KesImportOptions options;
  if (single) options.fabric = o.fabric;
  options.areal_density_kg_per_m2 = o.areal_density_kg_per_m2;
  const auto materials = importKes(o.csv, options);
  if (!materials) return materials.error();
  const auto done =
      single ? writeMaterial(o.output, materials->front().material) : writeFolder(o, *materials);
  if (!done) return done.error();

  std::vector<FlaggedRow> flagged;
  auto names = nlohmann::json::array();
  for (const ImportedMaterial& m : *materials) {
    names.push_back(m.material.fabric);
    flagged.insert(flagged.end(), m.flagged.begin(), m.flagged.end());
  }
  warnFlagged(flagged, console);
  console.answer = {{"output", o.output}, {"fabrics", names}, {"flagged", flaggedToJson(flagged)}};
  console.say(o.output + ": " + counted(materials->size(), "material") + ", " +
              counted(flagged.size(), "contradiction"));
  return kDone;
}

}  // namespace

Verb kesImport() {
  return {"kes", "Results of the KES-FB instruments (CSV)",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
