// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/rig_config.h"

#include <algorithm>
#include <map>
#include <set>

#include "tenter/calib/cell_calibration.h"
#include "tenter/calib/cord_calibration.h"
#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"
#include "tenter/core/toml_document.h"
#include "tenter/rig/shipped_files.h"

namespace tenter {
namespace {

using Range = JsonReader::Range;
namespace fs = std::filesystem;

constexpr const char* kPage = "docs/formats/rig.md";
constexpr double kReaction_s = 0.25;
constexpr std::size_t kMaxFile_bytes = std::size_t{1} << 20;
constexpr std::size_t kMaxName = 64, kMaxAxes = 64;

RigLimits readLimits(JsonReader in) {
  onlyKnownKeys(in,
                {"absolute_N", "working_N", "slack_N", "slope_N_per_s", "stiffest_sample_N_per_m",
                 "following_error_m"},
                kPage);
  RigLimits limits;
  limits.absolute_N = in.number("absolute_N", Range::positive(1e4));
  limits.working_N = in.number("working_N", Range::positive(1e4));
  limits.slack_N = in.number("slack_N", Range::positive(1e3));
  limits.slope_N_per_s = in.number("slope_N_per_s", Range::positive(1e5));
  limits.stiffest_sample_N_per_m = in.number("stiffest_sample_N_per_m", Range::positive(1e7));
  limits.following_error_m = in.number("following_error_m", Range::positive(0.1));
  if (!in.ok()) return limits;
  if (limits.working_N >= limits.absolute_N) in.fail("working_N", "must be below absolute_N");
  if (limits.slack_N >= limits.working_N) in.fail("slack_N", "must be below working_N");
  return limits;
}

/// Maps are read once each, by name.
class MapShelf {
 public:
  /// Without a folder there are no maps.
  explicit MapShelf(std::optional<fs::path> folder) : folder_(std::move(folder)) {}

  std::shared_ptr<const RegisterMap> get(JsonReader& in) {
    const std::string name = in.text("map", 512);
    if (!in.ok() || !folder_) return nullptr;
    if (const auto known = maps_.find(name); known != maps_.end()) return known->second;
    const ShippedFile* shipped = findShippedFile(shippedRegisterMaps(), name);
    const Result<RegisterMap> map = shipped != nullptr ? parseRegisterMap(shipped->text, name)
                                                       : readRegisterMap(*folder_ / name);
    if (!map) {
      std::string names;
      for (const ShippedFile& file : shippedRegisterMaps()) {
        names += (names.empty() ? "" : ", ") + std::string(file.name);
      }
      in.fail("map", map.error().message(), "a file beside this one, or one of: " + names);
      return nullptr;
    }
    return maps_[name] = std::make_shared<RegisterMap>(*map);
  }

 private:
  std::optional<fs::path> folder_;
  std::map<std::string, std::shared_ptr<const RegisterMap>> maps_;
};

void readCells(JsonReader& in, RigConfig& rig, const std::optional<fs::path>& folder) {
  MapShelf maps(folder);
  const std::size_t size = in.arraySize("cell");
  if (in.ok() && (size == 0 || size > kMaxAxes)) in.fail("cell", "must be there 1 to 64 times");
  std::set<std::string> names;
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    JsonReader entry = in.element("cell", i);
    onlyKnownKeys(
        entry,
        {"name", "address", "unit", "map", "capacity_N", "lowest_N", "reversed", "stuck_after_ms"},
        kPage);
    LoadCellConfig cell;
    cell.id = entry.text("name", kMaxName);
    const auto address = parseModbusAddress(entry.text("address", 256));
    if (entry.ok() && !address) entry.fail("address", address.error().message());
    if (address) cell.address = *address;
    cell.unit = static_cast<int>(entry.integer("unit", 1, 247));
    cell.map = maps.get(entry);
    cell.capacity_N = entry.number("capacity_N", Range::positive(1e5));
    cell.lowest_N = entry.numberOr("lowest_N", -rig.limits.slack_N, Range::between(-1e5, 0.0));
    if (entry.has("reversed")) cell.reversed = entry.boolean("reversed");
    if (entry.has("stuck_after_ms")) {
      cell.stuck_after = std::chrono::milliseconds(entry.integer("stuck_after_ms", 0, 60'000));
    }
    if (entry.ok() && cell.capacity_N < rig.limits.absolute_N) {
      entry.fail("capacity_N", "is below limits.absolute_N: the limit would not be seen");
    }
    if (entry.ok() && !names.insert(cell.id).second) entry.fail("name", "another cell has it");
    rig.cells.push_back(std::move(cell));
  }
}

/// Gain and zero of every cell. What a session holds was applied already.
void readCellCalibrationOf(JsonReader& in, RigConfig& rig, const fs::path& folder) {
  const std::string name = in.text("cells", 512);
  if (!in.ok()) return;
  const auto calibration = readCellCalibration(folder / name);
  if (!calibration) return in.fail("cells", calibration.error().message());
  if (!calibration->accepted) {
    return in.fail("cells", name + " was rejected", "calibrate the cells again");
  }
  for (LoadCellConfig& cell : rig.cells) {
    const CellLine* line = calibration->find(cell.id);
    if (line == nullptr) return in.fail("cells", name + " does not have " + cell.id);
    cell.gain = line->gain;
    cell.offset_N = line->offset_N;
  }
  rig.calibration_ids["cells"] = calibration->id;
}

/// Whoever takes friction off a session's tensions has to know which calibration was in force.
void readCordCalibrationOf(JsonReader& in, RigConfig& rig, const fs::path& folder) {
  const std::string name = in.text("cords", 512);
  if (!in.ok()) return;
  const auto calibration = readCordCalibration(folder / name);
  if (!calibration) return in.fail("cords", calibration.error().message());
  if (!calibration->accepted) {
    return in.fail("cords", name + " was rejected", "calibrate the cords again");
  }
  rig.calibration_ids["cords"] = calibration->id;
}

void readCalibrations(JsonReader in, RigConfig& rig, const std::optional<fs::path>& folder) {
  onlyKnownKeys(in, {"cells", "cords"}, kPage);
  if (!folder || !in.ok()) return;
  if (in.has("cells")) readCellCalibrationOf(in, rig, *folder);
  if (in.has("cords")) readCordCalibrationOf(in, rig, *folder);
}

std::optional<int> readCellOf(JsonReader& entry, const RigConfig& rig) {
  if (!entry.has("cell")) return std::nullopt;
  const std::string name = entry.text("cell", kMaxName);
  const auto cell = std::find_if(rig.cells.begin(), rig.cells.end(),
                                 [&](const LoadCellConfig& c) { return c.id == name; });
  if (cell == rig.cells.end()) {
    entry.fail("cell", "there is no cell \"" + name + "\"");
    return std::nullopt;
  }
  const int index = static_cast<int>(cell - rig.cells.begin());
  for (const RigAxis& other : rig.axes) {
    if (other.cell == index) entry.fail("cell", "axis " + other.device.name + " has that cell");
  }
  return index;
}

RigAxis readAxis(JsonReader entry, const RigConfig& rig) {
  onlyKnownKeys(entry,
                {"name", "driver", "serial", "port", "metres_per_unit", "origin_m", "travel_m",
                 "max_speed_m_per_s", "max_acceleration_m_per_s2", "command_timeout_ms",
                 "full_speed_m_per_s", "kill_switch", "cell"},
                kPage);
  RigAxis axis;
  AxisConfig& device = axis.device;
  device.name = entry.text("name", kMaxName);
  device.driver = entry.textOr("driver", device.driver);
  device.serial = entry.textOr("serial", "");
  device.port = entry.textOr("port", "");
  device.metres_per_unit = entry.number("metres_per_unit", Range::between(-1.0, 1.0));
  device.origin_m = entry.numberOr("origin_m", 0.0, Range::between(-10.0, 10.0));
  const std::vector<double> travel = entry.numbers("travel_m", Range::between(-10.0, 10.0));
  if (entry.ok() && travel.size() != 2) entry.fail("travel_m", "must be [smallest, largest]");
  if (travel.size() == 2) {
    device.travel_min_m = travel[0];
    device.travel_max_m = travel[1];
  }
  device.max_speed_m_per_s = std::min(entry.number("max_speed_m_per_s", Range::positive(1.0)),
                                      speedCap_m_per_s(rig.limits));
  device.max_acceleration_m_per_s2 =
      entry.numberOr("max_acceleration_m_per_s2", 0.0, Range::nonNegative(100.0));
  device.full_speed_m_per_s = entry.numberOr("full_speed_m_per_s", 0.0, Range::nonNegative(1.0));
  const ActuatorDriverRow* driver = findActuatorDriver(device.driver);
  device.kill_switch = entry.has("kill_switch") ? entry.boolean("kill_switch")
                                                : driver != nullptr && driver->sees_kill_switch;
  if (entry.has("command_timeout_ms")) {
    device.command_timeout =
        std::chrono::milliseconds(entry.integer("command_timeout_ms", 60, 200));
  }
  axis.cell = readCellOf(entry, rig);
  if (entry.ok()) {
    if (const auto good = checkAxisConfig(device); !good) {
      entry.fail(good.error().place, good.error().reason, good.error().advice);
    }
  }
  if (entry.ok() && rig.findAxis(device.name)) entry.fail("name", "another axis has it");
  return axis;
}

Result<RigConfig> parse(std::string_view toml, const std::string& file,
                        const std::optional<fs::path>& map_folder) {
  const auto json = jsonOfToml(toml, file);
  if (!json) return json.error();
  JsonReader in(*json, file);
  onlyKnownKeys(in, {"schema_version", "name", "limits", "axis", "cell", "cameras", "calibration"},
                kPage);
  in.integer("schema_version", 1, 1);
  RigConfig rig;
  rig.text = toml;
  rig.name = in.text("name", kMaxName);
  rig.limits = readLimits(in.object("limits"));
  if (!in.ok()) return in.error();
  readCells(in, rig, map_folder);
  if (in.has("calibration")) readCalibrations(in.object("calibration"), rig, map_folder);
  const std::size_t size = in.arraySize("axis");
  if (in.ok() && (size == 0 || size > kMaxAxes)) in.fail("axis", "must be there 1 to 64 times");
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    rig.axes.push_back(readAxis(in.element("axis", i), rig));
  }
  if (!in.ok()) return in.error();
  return rig;
}

}  // namespace

double speedCap_m_per_s(const RigLimits& limits) {
  return (limits.absolute_N - limits.working_N) / (limits.stiffest_sample_N_per_m * kReaction_s);
}

std::optional<int> RigConfig::findAxis(std::string_view axis_name) const {
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (axes[i].device.name == axis_name) return static_cast<int>(i);
  }
  return std::nullopt;
}

Result<RigConfig> readRigConfig(const fs::path& file) {
  const Result<std::string> text = readFile(file, kMaxFile_bytes);
  if (!text) return text.error();
  return parseRigConfig(*text, file);
}

Result<RigConfig> parseRigConfig(std::string_view toml, const fs::path& file) {
  return parse(toml, file.string(), file.parent_path());
}

Result<RigConfig> parseRecordedRigConfig(std::string_view toml) {
  return parse(toml, "session.json: rig_configuration", std::nullopt);
}

}  // namespace tenter
