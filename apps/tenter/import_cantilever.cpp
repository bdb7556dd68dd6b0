// SPDX-License-Identifier: GPL-3.0-or-later
#include "import_options.h"
#include "output_guard.h"
#include "tenter/core/measurement_folder.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  SpecimenOptions specimen;
  std::string csv;
  double length_mm = 0.0, width_mm = 25.0, angle_deg = 0.0, tip_sigma_mm = 0.0;
  double reach_mm = 0.0, drop_mm = 0.0;
  CLI::Option *reach_option = nullptr, *drop_option = nullptr;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("csv", o.csv, "Rows of reach [mm], drop [mm] of equal strips");
  command.add_option("--length-mm", o.length_mm, "Free length of the strip")->required();
  command.add_option("--width-mm", o.width_mm, "Width of the strip")->capture_default_str();
  o.reach_option =
      command.add_option("--reach-mm", o.reach_mm, "Horizontal distance of the tip from the clamp");
  o.drop_option =
      command.add_option("--drop-mm", o.drop_mm, "Vertical distance of the tip below the clamp");
  command.add_option("--angle-deg", o.angle_deg, "From weft to the strip's length")->required();
  command.add_option("--tip-sigma-mm", o.tip_sigma_mm, "Standard deviation of each distance");
  declareSpecimen(command, o.specimen);
}

Result<Measurement> import(const Options& o) {
  CantileverImportOptions si;
  si.info = o.specimen.inSi();
  si.length_m = kMetresPerMm * o.length_mm;
  si.width_m = kMetresPerMm * o.width_mm;
  si.angle_rad = kRadiansPerDegree * o.angle_deg;
  si.tip_sigma_m = kMetresPerMm * o.tip_sigma_mm;
  if (!o.csv.empty()) return importCantilever(o.csv, si);
  return importCantilever(kMetresPerMm * o.reach_mm, kMetresPerMm * o.drop_mm, si);
}

Result<int> run(const Options& o, Console& console) {
  const bool reach = o.reach_option->count() > 0, drop = o.drop_option->count() > 0;
  if (reach != drop || reach == !o.csv.empty()) {
    return usageError("give either --reach-mm and --drop-mm, or a CSV");
  }
  if (auto free = checkOutputFolder(o.specimen.output, measurementFolder()); !free) {
    return free.error();
  }
  const auto measurement = import(o);
  if (!measurement) return measurement.error();
  return finishMeasurement(*measurement, o.specimen.output, console);
}

}  // namespace

Verb cantileverImport() {
  return {"cantilever", "A strip clamped horizontally, hanging under its own weight: its tip",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
