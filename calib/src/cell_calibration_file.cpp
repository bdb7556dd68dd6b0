// SPDX-License-Identifier: GPL-3.0-or-later
#include <set>

#include "calibration_id.h"
#include "cell_calibration_json.h"
#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"

namespace tenter {
namespace {

using Json = nlohmann::ordered_json;
using Range = JsonReader::Range;

constexpr std::size_t kMaxCells = 256, kMaxLoads = 10'000, kMaxName = 64;
constexpr double kMaxForce_N = 1e5;
constexpr const char* kAccepted = "accepted";
constexpr const char* kRejected = "rejected";

Json lineJson(const CellLine& line) {
  Json loads = Json::array();
  for (const DeadLoad& load : line.loads) {
    Json row{{"force_N", load.force_N}, {"reading_N", load.reading_N}, {"sigma_N", load.sigma_N}};
    if (load.temperature_degC) row["temperature_degC"] = *load.temperature_degC;
    loads.push_back(row);
  }
  return {{"cell", line.cell},
          {"gain", line.gain},
          {"offset_N", line.offset_N},
          {"gain_sigma", line.gain_sigma},
          {"offset_sigma_N", line.offset_sigma_N},
          {"correlation", line.correlation},
          {"rms_N", line.rms_N},
          {"largest_N", line.largest_N},
          {"hysteresis_N", line.hysteresis_N},
          {"loads", loads}};
}

Json encode(const CellCalibration& c) {
  Json cells = Json::array();
  for (const CellLine& line : c.cells) cells.push_back(lineJson(line));
  return {{"format", kCellCalibrationMarker},
          {"schema_version", 1},
          {"units", "SI"},
          {"note", c.note},
          {"verdict", c.accepted ? kAccepted : kRejected},
          {"reasons", c.reasons},
          {"warnings", c.warnings},
          {"cells", cells}};
}

DeadLoad readLoad(JsonReader in) {
  DeadLoad load;
  load.force_N = in.number("force_N", Range::between(-kMaxForce_N, kMaxForce_N));
  load.reading_N = in.number("reading_N", Range::between(-kMaxForce_N, kMaxForce_N));
  load.sigma_N = in.number("sigma_N", Range::nonNegative(kMaxForce_N));
  if (in.has("temperature_degC")) {
    load.temperature_degC = in.number("temperature_degC", Range::between(-50.0, 100.0));
  }
  return load;
}

CellLine readLine(JsonReader in) {
  CellLine line;
  line.cell = in.text("cell", kMaxName);
  line.gain = in.number("gain", Range::between(-100.0, 100.0));
  line.offset_N = in.number("offset_N", Range::between(-kMaxForce_N, kMaxForce_N));
  line.gain_sigma = in.number("gain_sigma", Range::nonNegative(100.0));
  line.offset_sigma_N = in.number("offset_sigma_N", Range::nonNegative(kMaxForce_N));
  line.correlation = in.number("correlation", Range::between(-1.0, 1.0));
  line.rms_N = in.number("rms_N", Range::nonNegative(kMaxForce_N));
  line.largest_N = in.number("largest_N", Range::nonNegative(kMaxForce_N));
  line.hysteresis_N = in.number("hysteresis_N", Range::nonNegative(2.0 * kMaxForce_N));
  const std::size_t size = in.arraySize("loads");
  if (in.ok() && size > kMaxLoads) in.fail("loads", "are too many");
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    line.loads.push_back(readLoad(in.element("loads", i)));
  }
  if (in.ok() && line.gain == 0.0) in.fail("gain", "must not be zero");
  return line;
}

}  // namespace

std::string idOf(const CellCalibration& calibration) {
  return contentId("cells-", encode(calibration));
}

Result<void> writeCellCalibration(const std::filesystem::path& file,
                                  const CellCalibration& calibration) {
  Json document = encode(calibration);
  document["id"] = calibration.id;
  return writeFileAtomically(file, document.dump(2) + "\n");
}

Result<CellCalibration> readCellCalibration(const std::filesystem::path& file) {
  const auto json = readJsonFile(file);
  if (!json) return json.error();
  JsonReader in(*json, file.string());
  if (in.text("format") != kCellCalibrationMarker && in.ok()) {
    in.fail("format", "is no calibration of load cells");
  }
  in.integer("schema_version", 1, 1);
  CellCalibration out;
  out.id = in.text("id", kMaxName);
  out.note = in.text("note");
  const std::string verdict = in.text("verdict", kMaxName);
  out.accepted = verdict == kAccepted;
  if (in.ok() && !out.accepted && verdict != kRejected) {
    in.fail("verdict", "must be accepted or rejected");
  }
  out.reasons = in.texts("reasons");
  out.warnings = in.texts("warnings");
  const std::size_t size = in.arraySize("cells");
  if (in.ok() && (size == 0 || size > kMaxCells)) in.fail("cells", "must be 1 to 256");
  std::set<std::string> names;
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    out.cells.push_back(readLine(in.element("cells", i)));
    if (!names.insert(out.cells.back().cell).second) in.fail("cells", "has a cell twice");
  }
  if (in.ok() && out.id != idOf(out)) {
    in.fail("id", "is not that of the content", "calibrate again instead of editing the file");
  }
  if (!in.ok()) return in.error();
  return out;
}

}  // namespace tenter
