// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "import_options.h"
#include "output_guard.h"
#include "tenter/core/measurement_folder.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  SpecimenOptions specimen;
  std::string csv, rule = "extrapolate";
  double length_mm = 0.0, width_mm = 0.0, angle_deg = 0.0, zero_offset_mm = 0.0;
  CLI::Option* offset_option = nullptr;
  double force_sigma_N = 0.0;
  int strips = 1;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("csv", o.csv, "Rows of displacement [mm], force [N]")->required();
  command.add_option("--length-mm", o.length_mm, "Between the clamps at displacement 0")
      ->required();
  command.add_option("--width-mm", o.width_mm, "Width of one strip")->required();
  command.add_option("--strips", o.strips, "Equal strips side by side that share the force")
      ->capture_default_str();
  command.add_option("--angle-deg", o.angle_deg, "From weft to the pulling direction")->required();
  command
      .add_option("--zero-strain", o.rule,
                  "Where strain is zero: extrapolate (zero force), first-row, or given")
      ->capture_default_str();
  o.offset_option = command.add_option("--zero-offset-mm", o.zero_offset_mm,
                                       "With `given`: stretch that the strip already had at "
                                       "displacement 0");
  command.add_option("--force-sigma-N", o.force_sigma_N, "Standard deviation of the force");
  declareSpecimen(command, o.specimen);
}

Result<TensileImportOptions> inSi(const Options& o) {
  const auto rule = parseZeroStrainRule(o.rule);
  if (!rule) return rule.error();
  const bool given = *rule == ZeroStrainRule::kGiven;
  if (given != (o.offset_option->count() > 0)) {
    return usageError("--zero-strain given and --zero-offset-mm go together");
  }
  TensileImportOptions si;
  si.info = o.specimen.inSi();
  si.length_m = kMetresPerMm * o.length_mm;
  si.width_m = kMetresPerMm * o.width_mm;
  si.strips = o.strips;
  si.angle_rad = kRadiansPerDegree * o.angle_deg;
  si.zero_strain = *rule;
  si.zero_offset_m = kMetresPerMm * o.zero_offset_mm;
  si.force_sigma_N = o.force_sigma_N;
  return si;
}

Result<int> run(const Options& o, Console& console) {
  const auto options = inSi(o);
  if (!options) return options.error();
  if (auto free = checkOutputFolder(o.specimen.output, measurementFolder()); !free) {
    return free.error();
  }
  const auto measurement = importTensile(o.csv, *options);
  if (!measurement) return measurement.error();
  const auto unloading =
      std::count_if(measurement->frames.begin(), measurement->frames.end(),
                    [](const MeasurementFrame& f) { return f.branch == Branch::kUnloading; });
  console.answer["zero_strain"] = {{"rule", measurement->tensile->zero_strain_rule},
                                   {"offset_m", measurement->tensile->zero_offset_m}};
  console.answer["unloading_frames"] = unloading;
  return finishMeasurement(*measurement, o.specimen.output, console);
}

}  // namespace

Verb tensileImport() {
  return {"tensile", "A strip pulled at any angle: force over displacement (CSV)",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
