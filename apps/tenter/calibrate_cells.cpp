// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdio>

#include "force_calibration.h"
#include "output_guard.h"
#include "tenter/calib/cell_calibration.h"
#ifdef TENTER_HARDWARE
#include "live_cells.h"
#endif

namespace tenter::app {

namespace {

constexpr double kGram_kg = 1e-3, kPercent = 1e-2;

struct Options {
  std::string weights, output, socket, note;
  std::vector<std::string> cells;
  std::vector<double> weights_g;
  double max_residual_percent = 0.2, gravity_m_per_s2 = 9.80665;
  std::optional<double> temperature_degC;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("weights", o.weights,
                     "Table of dead weights (CSV): cell, mass_g, reading_N, and if known sigma_N, "
                     "temperature_degC");
  command.add_option("-o,--output", o.output, "File of the calibration")->required();
  command
      .add_option("--max-residual-percent", o.max_residual_percent,
                  "Reject if readings lie further off the line, of the largest weight")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_option("--gravity", o.gravity_m_per_s2, "m/s2, where the weights hang")
      ->check(CLI::Range(9.7, 9.9))
      ->capture_default_str();
  command.add_option("--note", o.note, "For people: weights, thermometer, who");
#ifdef TENTER_HARDWARE
  command.add_option("--socket", o.socket, "Read the cells live through this tenterd instead");
  command.add_option("--cell", o.cells, "Live: cells to load, one after the other");
  command.add_option("--weights-g", o.weights_g, "Live: weights to hang on, in their order")
      ->delimiter(',');
  command.add_option("--temperature-degc", o.temperature_degC, "Live: of the room");
#endif
}

Result<std::vector<CellLoads>> loadsOf(const Options& o, Console& console) {
  if (o.weights.empty() == o.socket.empty()) {
    return usageError("give either a table of weights or --socket");
  }
  if (o.socket.empty()) return readDeadLoads(o.weights, o.gravity_m_per_s2);
#ifdef TENTER_HARDWARE
  if (o.cells.empty() || o.weights_g.empty()) {
    return usageError("--socket needs --cell and --weights-g");
  }
  LiveWeights live{o.socket, o.cells, {}, o.temperature_degC};
  for (const double weight_g : o.weights_g) {
    live.forces_N.push_back(kGram_kg * weight_g * o.gravity_m_per_s2);
  }
  return weighLive(live, console);
#else
  (void)console;
  return usageError("this program was built without devices");
#endif
}

Result<int> run(const Options& o, Console& console) {
  if (auto free = checkOutputFile(o.output, kCellCalibrationMarker); !free) return free.error();
  const auto loads = loadsOf(o, console);
  if (!loads) return loads.error();
  CellCalibrationOptions options;
  options.note = o.note;
  options.gravity_m_per_s2 = o.gravity_m_per_s2;
  options.max_residual_share = kPercent * o.max_residual_percent;
  const auto calibration = calibrateCells(*loads, options);
  if (!calibration) return calibration.error().in(o.weights);
  if (auto done = writeCellCalibration(o.output, *calibration); !done) return done.error();
  console.answer = {{"id", calibration->id},
                    {"file", o.output},
                    {"verdict", calibration->accepted ? "accepted" : "rejected"},
                    {"reasons", calibration->reasons},
                    {"warnings", calibration->warnings},
                    {"cells", nlohmann::json::array()}};
  for (const CellLine& line : calibration->cells) {
    console.answer["cells"].push_back({{"cell", line.cell},
                                       {"gain", line.gain},
                                       {"gain_sigma", line.gain_sigma},
                                       {"offset_N", line.offset_N},
                                       {"offset_sigma_N", line.offset_sigma_N},
                                       {"rms_N", line.rms_N},
                                       {"largest_N", line.largest_N},
                                       {"hysteresis_N", line.hysteresis_N},
                                       {"loads", line.loads.size()}});
    char text[200];
    std::snprintf(text, sizeof text,
                  "%s: gain %.6f +- %.6f, offset %.2f +- %.2f mN, residual %.2f mN (largest %.2f)",
                  line.cell.c_str(), line.gain, line.gain_sigma, 1e3 * line.offset_N,
                  1e3 * line.offset_sigma_N, 1e3 * line.rms_N, 1e3 * line.largest_N);
    console.say(text);
  }
  for (const std::string& warning : calibration->warnings) console.warn(warning);
  for (const std::string& reason : calibration->reasons) Console::complain(reason);
  console.say(calibration->id + (calibration->accepted ? ": accepted" : ": rejected"));
  return calibration->accepted ? kDone : static_cast<int>(ErrorKind::kCalibrationRejected);
}

}  // namespace

Verb cellsCalibration() {
  return {"cells", "Gain and zero of load cells from dead weights",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
