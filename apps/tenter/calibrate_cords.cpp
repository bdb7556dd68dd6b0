// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstdio>
#include <limits>

#include "force_calibration.h"
#include "output_guard.h"
#include "tenter/calib/cord_calibration.h"
#include "tenter/rig/rig_config.h"
#include "tenter/session/session_reader.h"

namespace tenter::app {

namespace {

constexpr double kPercent = 1e-2, kMilli = 1e3;

struct Options {
  std::string springs, held, output, note;
  double max_residual_percent = 2.0;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("--springs", o.springs,
                     "Session in which each cord was drawn in on a spring and let out: friction");
  command.add_option("--held", o.held,
                     "Session in which each cord was drawn in against its held end: stretch");
  command.add_option("-o,--output", o.output, "File of the calibration")->required();
  command
      .add_option("--max-residual-percent", o.max_residual_percent,
                  "Reject if a cord fits worse, of its highest tension")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_option("--note", o.note, "For people");
}

/// One record for each axis that has a cell.
Result<std::vector<CordRecord>> recordsOf(const std::string& session) {
  auto reader = SessionReader::open(session);
  if (!reader) return reader.error();
  const SessionHeader& header = (*reader)->header();
  const auto rig = parseRecordedRigConfig(header.rig_configuration);
  if (!rig) return rig.error().in(session);
  if (rig->axes.size() != header.actuators.size() || rig->cells.size() != header.cells.size()) {
    return badInput(session, "rig_configuration", "is that of another rig");
  }
  std::vector<CordRecord> records(rig->axes.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    records[i].axis = header.actuators[i];
    if (rig->axes[i].cell) {
      records[i].cell = header.cells[static_cast<std::size_t>(*rig->axes[i].cell)];
    }
  }
  for (;;) {
    auto record = (*reader)->next();
    if (!record) return record.error();
    if (!*record) break;
    const auto* sample = std::get_if<SampleRecord>(&(*record)->body);
    if (sample == nullptr) continue;
    for (std::size_t i = 0; i < records.size(); ++i) {
      if (!rig->axes[i].cell || !sample->positions_m[i]) continue;
      const TensionReading& tension =
          sample->tensions[static_cast<std::size_t>(*rig->axes[i].cell)];
      const bool good = tension.status == TensionStatus::kOk && tension.tension_N;
      records[i].positions_m.push_back(*sample->positions_m[i]);
      records[i].tensions_N.push_back(good ? *tension.tension_N
                                           : std::numeric_limits<double>::quiet_NaN());
    }
  }
  return records;
}

void tell(const CordEntry& cord, Console& console) {
  nlohmann::json row{{"axis", cord.axis}, {"cell", cord.cell}};
  std::string text = cord.axis + ":";
  char part[160];
  if (cord.friction) {
    row["friction_N"] = cord.friction->friction_N;
    row["friction_sigma_N"] = cord.friction->friction_sigma_N;
    row["presliding_m"] = cord.friction->presliding_m;
    row["spring_N_per_m"] = cord.friction->spring_N_per_m;
    row["friction_rms_N"] = cord.friction->rms_N;
    std::snprintf(part, sizeof part, " friction %.2f +- %.2f mN, turning within %.3f mm",
                  kMilli * cord.friction->friction_N, kMilli * cord.friction->friction_sigma_N,
                  kMilli * cord.friction->presliding_m);
    text += part;
  }
  if (cord.stretch) {
    row["stiffness_N_per_m"] = cord.stretch->stiffness_N_per_m;
    row["stiffness_sigma_N_per_m"] = cord.stretch->stiffness_sigma_N_per_m;
    row["stretch_rms_N"] = cord.stretch->rms_N;
    std::snprintf(part, sizeof part, "%s stretch %.1f +- %.1f N/m", cord.friction ? "," : "",
                  cord.stretch->stiffness_N_per_m, cord.stretch->stiffness_sigma_N_per_m);
    text += part;
  }
  console.answer["cords"].push_back(row);
  console.say(text);
}

Result<int> run(const Options& o, Console& console) {
  if (o.springs.empty() && o.held.empty()) return usageError("give --springs, --held or both");
  if (auto free = checkOutputFile(o.output, kCordCalibrationMarker); !free) return free.error();
  std::vector<CordRecord> springs, held;
  for (const auto& [session, records] :
       {std::pair(&o.springs, &springs), std::pair(&o.held, &held)}) {
    if (session->empty()) continue;
    auto read = recordsOf(*session);
    if (!read) return read.error();
    *records = *std::move(read);
  }
  CordCalibrationOptions options;
  options.note = o.note;
  options.max_residual_share = kPercent * o.max_residual_percent;
  const auto calibration = calibrateCords(springs, held, options);
  if (!calibration) return calibration.error();
  if (auto done = writeCordCalibration(o.output, *calibration); !done) return done.error();
  console.answer = {{"id", calibration->id},
                    {"file", o.output},
                    {"verdict", calibration->accepted ? "accepted" : "rejected"},
                    {"reasons", calibration->reasons},
                    {"warnings", calibration->warnings},
                    {"cords", nlohmann::json::array()}};
  for (const CordEntry& cord : calibration->cords) tell(cord, console);
  for (const std::string& warning : calibration->warnings) console.warn(warning);
  for (const std::string& reason : calibration->reasons) Console::complain(reason);
  console.say(calibration->id + (calibration->accepted ? ": accepted" : ": rejected"));
  return calibration->accepted ? kDone : static_cast<int>(ErrorKind::kCalibrationRejected);
}

}  // namespace

Verb cordsCalibration() {
  return {"cords", "Friction of pulleys and stretch of cords from recorded sessions",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
