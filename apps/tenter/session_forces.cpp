// SPDX-License-Identifier: GPL-3.0-or-later
#include "session_forces.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "output_guard.h"
#include "tenter/calib/cord_friction.h"
#include "tenter/core/files.h"
#include "tenter/session/session_reader.h"

namespace tenter::app {

namespace {

constexpr std::string_view kNames = "time_s,axis,cell,position_m,measured_N,friction_N,tension_N\n";

struct Options {
  std::string session, cords, output;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("session", o.session, "Folder of the session")->required();
  command.add_option("--cords", o.cords, "Calibration of the cords")->required();
  command.add_option("-o,--output", o.output, "Table (CSV)")->required();
}

/// One cord of the calibration in the session.
struct Cord {
  const CordEntry* entry;
  std::size_t axis, cell;
  std::vector<double> times_s, positions_m, measured_N;
};

std::size_t placeOf(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

Result<std::vector<Cord>> cordsIn(const SessionHeader& header, const CordCalibration& calibration,
                                  const std::string& file) {
  std::vector<Cord> cords;
  for (const CordEntry& entry : calibration.cords) {
    if (!entry.friction) continue;
    const Cord cord{
        &entry, placeOf(header.actuators, entry.axis), placeOf(header.cells, entry.cell), {}, {},
        {}};
    if (cord.axis < header.actuators.size() && cord.cell < header.cells.size())
      cords.push_back(cord);
  }
  if (cords.empty()) return badInput(file, "cords", "none of them is in the session");
  return cords;
}

Result<void> read(SessionReader& reader, std::vector<Cord>& cords) {
  for (;;) {
    auto record = reader.next();
    if (!record) return record.error();
    if (!*record) return {};
    const auto* sample = std::get_if<SampleRecord>(&(*record)->body);
    if (sample == nullptr) continue;
    for (Cord& cord : cords) {
      const TensionReading& tension = sample->tensions[cord.cell];
      if (!sample->positions_m[cord.axis]) continue;
      const bool good = tension.status == TensionStatus::kOk && tension.tension_N;
      cord.times_s.push_back(1e-9 * static_cast<double>((*record)->time_ns));
      cord.positions_m.push_back(*sample->positions_m[cord.axis]);
      cord.measured_N.push_back(good ? *tension.tension_N
                                     : std::numeric_limits<double>::quiet_NaN());
    }
  }
}

std::size_t append(const Cord& cord, std::string& csv) {
  const auto friction_N = frictionAlong(*cord.entry, cord.positions_m, cord.measured_N);
  std::size_t rows = 0;
  char line[256];
  for (std::size_t i = 0; i < friction_N.size(); ++i) {
    if (!std::isfinite(cord.measured_N[i])) continue;
    std::snprintf(line, sizeof line, ",%.9g,%.9g,%.9g,%.9g\n", cord.positions_m[i],
                  cord.measured_N[i], friction_N[i], cord.measured_N[i] - friction_N[i]);
    char time[32];
    std::snprintf(time, sizeof time, "%.6f", cord.times_s[i]);
    csv += std::string(time) + "," + cord.entry->axis + "," + cord.entry->cell + line;
    ++rows;
  }
  return rows;
}

Result<int> run(const Options& o, Console& console) {
  if (auto free = checkOutputFile(o.output, kNames); !free) return free.error();
  const auto calibration = readCordCalibration(o.cords);
  if (!calibration) return calibration.error();
  if (!calibration->accepted) {
    return Error{ErrorKind::kCalibrationRejected, o.cords, "verdict", "was rejected",
                 "calibrate the cords again"};
  }
  const auto reader = SessionReader::open(o.session);
  if (!reader) return reader.error();
  auto cords = cordsIn((*reader)->header(), *calibration, o.cords);
  if (!cords) return cords.error();
  if (auto done = read(**reader, *cords); !done) return done.error();
  std::string csv(kNames);
  std::size_t rows = 0;
  std::vector<std::string> by_travel;
  for (const Cord& cord : *cords) {
    rows += append(cord, csv);
    if (!cord.entry->stretch) by_travel.push_back(cord.entry->axis);
  }
  if (auto done = writeFileAtomically(o.output, csv); !done) return done.error();
  console.answer = {{"file", o.output},
                    {"calibration", calibration->id},
                    {"cords", cords->size()},
                    {"rows", rows},
                    {"by_travel_alone", by_travel}};
  for (const std::string& axis : by_travel) {
    console.warn(axis +
                 ": its stretch is not known, so the travel of its axis alone tells where it rubs");
  }
  console.say(counted(cords->size(), "cord") + ", " + counted(rows, "row") + " in " + o.output);
  return kDone;
}

}  // namespace

Verb sessionForces() {
  return {"forces", "Tensions without the friction of the pulleys, as a table",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
