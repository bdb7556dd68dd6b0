// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "output_guard.h"
#include "tenter/core/files.h"
#include "tenter/fitting/export.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  std::string material, target, output;
  double edge_mm = 0.0;
  CLI::Option* edge_option = nullptr;
};

void declare(CLI::App& command, Options& o) {
  std::string targets;
  for (const ExportTarget& target : exportTargets()) {
    targets += "\n  " + std::string(target.id) + ": " + std::string(target.description);
  }
  command.add_option("material", o.material, "Material file")->required();
  command.add_option("--to", o.target, "Target:" + targets)->required();
  o.edge_option =
      command.add_option("--edge-mm", o.edge_mm, "Mean edge of the mesh that will use the numbers");
  command.add_option("-o,--output", o.output, "File to write")->required();
}

nlohmann::json windowOf(const ExportedMaterial& exported) {
  nlohmann::json window = nlohmann::json::object();
  for (const ExportError& e : exported.errors) window[e.component] = {e.strain_min, e.strain_max};
  return window;
}

nlohmann::json errorsOf(const ExportedMaterial& exported) {
  auto rows = nlohmann::json::array();
  for (const ExportError& e : exported.errors) {
    rows.push_back({{"component", e.component},
                    {"strain_min", e.strain_min},
                    {"strain_max", e.strain_max},
                    {"measured", e.measured},
                    {"rms_rel", e.rms_rel},
                    {"max_rel", e.max_rel}});
  }
  return rows;
}

std::string percent(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f %%", 100.0 * value);
  return text;
}

void tell(const Options& o, const ExportedMaterial& exported, Console& console) {
  console.answer = {{"file", o.output},
                    {"to", o.target},
                    {"rms_rel", exported.rms_rel},
                    {"max_rel", exported.max_rel},
                    {"strain_window", windowOf(exported)},
                    {"bending_rms_rel", exported.bending_rms_rel},
                    {"bending_max_rel", exported.bending_max_rel},
                    {"components", errorsOf(exported)},
                    {"lost", exported.lost}};
  console.say(o.output + ": stress error " + percent(exported.rms_rel) + " RMS, " +
              percent(exported.max_rel) + " at most, over the measured strains");
  if (!std::isnan(exported.bending_rms_rel)) {
    console.say("bending moment error " + percent(exported.bending_rms_rel) + " RMS, " +
                percent(exported.bending_max_rel) + " at most");
  }
  for (const std::string& what : exported.lost) console.say("lost: " + what);
}

Result<int> run(const Options& o, Console& console) {
  const auto target = findExportTarget(o.target);
  if (!target) return target.error();
  if (auto free = checkOutputFile(o.output, (*target)->marker); !free) return free.error();
  const auto material = readMaterial(o.material);
  if (!material) return material.error();
  ExportOptions options;
  if (o.edge_option->count() > 0) options.edge_m = 1e-3 * o.edge_mm;
  const auto exported = exportMaterial(*material, **target, options);
  if (!exported) {
    return exported.error().file.empty() ? exported.error().in(o.material) : exported.error();
  }
  if (auto done = writeFileAtomically(o.output, exported->content); !done) return done.error();
  tell(o, *exported, console);
  return kDone;
}

}  // namespace

Verb exportVerb() {
  return {"export", "Write a material for another program, and say what that loses",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
