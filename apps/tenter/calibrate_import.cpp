// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <charconv>

#include "calibration_report.h"
#include "output_guard.h"
#include "tenter/calib/calibration_import.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  std::vector<std::string> files;
  std::string output, unit = "mm", size;
};

struct Unit {
  std::string_view name;
  double metres;
};
constexpr std::array kUnits = {Unit{"mm", 1e-3}, Unit{"cm", 1e-2}, Unit{"m", 1.0},
                               Unit{"in", 0.0254}};

void declare(CLI::App& command, Options& o) {
  command.add_option("files", o.files, "Calibration of OpenCV (YAML, XML, JSON) or DICe (XML)")
      ->required();
  command.add_option("--unit", o.unit, "What the file's lengths are in: mm, cm, m, in")
      ->capture_default_str();
  command.add_option("--size", o.size,
                     "Size of the images, such as 1280x960, if the file does not tell");
  command.add_option("-o,--output", o.output, "File of the calibration")->required();
}

Result<CalibrationImportOptions> inSi(const Options& o) {
  CalibrationImportOptions options;
  options.unit_m = 0.0;
  for (const Unit& unit : kUnits) {
    if (unit.name == o.unit) options.unit_m = unit.metres;
  }
  if (options.unit_m == 0.0) return usageError("--unit: '" + o.unit + "' is not mm, cm, m or in");
  if (o.size.empty()) return options;
  int width = 0, height = 0;
  const char *at = o.size.data(), *end = at + o.size.size();
  const auto first = std::from_chars(at, end, width);
  const bool separated = first.ec == std::errc() && first.ptr != end && *first.ptr == 'x';
  const auto second = separated ? std::from_chars(first.ptr + 1, end, height) : first;
  if (!separated || second.ec != std::errc() || second.ptr != end || width < 1 || height < 1) {
    return usageError("--size: '" + o.size + "' is not understood", "such as 1280x960");
  }
  options.size_px = std::pair(width, height);
  return options;
}

Result<int> run(const Options& o, Console& console) {
  const auto options = inSi(o);
  if (!options) return options.error();
  if (auto free = checkOutputFile(o.output, kCalibrationMarker); !free) return free.error();
  const auto calibration = importCalibration({o.files.begin(), o.files.end()}, *options);
  if (!calibration) return calibration.error();
  if (auto done = writeCalibration(o.output, *calibration); !done) return done.error();
  reportCalibration(*calibration, o.output, console);
  return kDone;
}

}  // namespace

Verb importedCalibration() {
  return {"import", "The calibration of another program: OpenCV or DICe",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
