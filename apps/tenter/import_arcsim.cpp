// SPDX-License-Identifier: GPL-3.0-or-later
#include "import_options.h"
#include "output_guard.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  std::string file, fabric, output;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("file", o.file, "Material file of ARCSim (JSON)")->required();
  command.add_option("--fabric", o.fabric, "Name of the fabric; the file's name if not given");
  command.add_option("-o,--output", o.output, "Material file to write")->required();
}

Result<int> run(const Options& o, Console& console) {
  if (auto free = checkMaterialOutput(o.output); !free) return free.error();
  const auto imported = importArcsim(o.file, o.fabric);
  if (!imported) return imported.error();
  if (auto done = writeMaterial(o.output, imported->material); !done) return done.error();
  warnFlagged(imported->flagged, console);
  console.answer = {{"material", o.output},
                    {"law", imported->material.law},
                    {"fabric", imported->material.fabric},
                    {"flagged", flaggedToJson(imported->flagged)}};
  console.say(o.output + ": " + counted(imported->flagged.size(), "row") + " flagged");
  return kDone;
}

}  // namespace

Verb arcsimImport() {
  return {"arcsim", "A material file of ARCSim (JSON)",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
