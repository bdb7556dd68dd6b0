// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/fault_script.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>

#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"
#include "tenter/core/toml_document.h"

namespace tenter {
namespace {

using Range = JsonReader::Range;

constexpr const char* kPage = "docs/formats/fault-script.md";
constexpr std::size_t kMaxFile_bytes = std::size_t{1} << 20;
constexpr std::size_t kMaxName = 64, kMaxFaults = 1000;
constexpr double kMaxTime_s = 1e5, kMaxForce_N = 1e4, kMaxDelay_ms = 60'000.0;
constexpr int kMaxCount = 1'000'000;
constexpr std::string_view kUnplug = "unplug", kSlow = "slow", kAddedForce = "added-force";
constexpr std::array<std::string_view, 6> kPhaseNames{"idle",    "homing",  "jog",
                                                      "loading", "holding", "unloading"};

constexpr std::string_view kCamera = "camera-";

struct CameraFaultRow {
  std::string_view name;
  CameraFault::Kind kind;
};
constexpr std::array<CameraFaultRow, 6> kCameraFaults{
    {{"lost-packets", CameraFault::Kind::kLostPackets},
     {kUnplug, CameraFault::Kind::kUnplugged},
     {"frozen", CameraFault::Kind::kFrozen},
     {"saturated", CameraFault::Kind::kSaturated},
     {"swapped", CameraFault::Kind::kSwapped},
     {"defocused", CameraFault::Kind::kDefocused}}};

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::chrono::microseconds microseconds(double time_ms) {
  return std::chrono::microseconds(std::llround(1e3 * time_ms));
}

/// Number of "axis-3" for the prefix "axis-", counted from 1; nothing if it is none of so many.
std::optional<int> numberBehind(std::string_view prefix, std::string_view name, int most) {
  if (!name.starts_with(prefix)) return std::nullopt;
  name.remove_prefix(prefix.size());
  int number = 0;
  const auto [end, problem] = std::from_chars(name.data(), name.data() + name.size(), number);
  const bool good =
      problem == std::errc() && end == name.data() + name.size() && number >= 1 && number <= most;
  return good ? std::optional(number) : std::nullopt;
}

/// "axis-3", "cell-3" or "camera-3".
void readDevice(JsonReader& in, ScriptedFault& fault, const FaultScriptRig& rig) {
  const std::string name = in.text("device", kMaxName);
  if (!in.ok()) return;
  const auto axis = numberBehind("axis-", name, rig.axes);
  const auto cell = numberBehind("cell-", name, rig.axes);
  const auto camera = numberBehind(kCamera, name, rig.cameras);
  if (!axis && !cell && !camera) {
    const std::string last = std::to_string(rig.axes);
    std::string known = "axis-1 to axis-" + last + ", cell-1 to cell-" + last;
    if (rig.cameras > 0) known += ", camera-1 to camera-" + std::to_string(rig.cameras);
    return in.fail("device", "there is no device \"" + name + "\"", known);
  }
  fault.on_axis = axis.has_value();
  fault.on_camera = camera.has_value();
  fault.device = axis.value_or(cell.value_or(camera.value_or(1))) - 1;
}

void readAxisKind(JsonReader& in, ScriptedFault& fault) {
  const auto& rows = virtualFaults();
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const VirtualFaultRow& known) {
    return known.name == fault.kind_name;
  });
  if (fault.kind_name == kUnplug) {
    fault.kind = UnplugFault{};
  } else if (fault.kind_name == kSlow) {
    fault.kind = SlowFault{microseconds(in.number("delay_ms", Range::positive(kMaxDelay_ms)))};
  } else if (row == rows.end()) {
    in.fail("kind", "an axis has no fault \"" + fault.kind_name + "\"", listed(axisFaultNames()));
  } else {
    fault.kind = row->fault;
    const bool passes = !row->lasts;
    // A passing one without an end of its own befalls one transfer.
    if (passes && !fault.for_s && fault.count == 0) fault.count = 1;
    if (!passes && fault.count != 0) in.fail("count", "this fault lasts", "for_s ends it");
  }
  const bool counts = std::holds_alternative<VirtualFault>(fault.kind);
  if (in.ok() && !counts && fault.count != 0) in.fail("count", "this fault lasts", "for_s ends it");
}

void readCellKind(JsonReader& in, ScriptedFault& fault, bool tcp) {
  if (fault.kind_name == kAddedForce) {
    fault.kind = AddedForceFault{in.number("added_N", Range::between(-kMaxForce_N, kMaxForce_N))};
    if (fault.count != 0) in.fail("count", "this fault lasts", "for_s ends it");
    return;
  }
  auto kind = parseVirtualCellFault(fault.kind_name);
  if (!kind) {
    return in.fail("kind", "a cell has no fault \"" + fault.kind_name + "\"",
                   listed(cellFaultNames()));
  }
  if (!canBefall(kind->kind, tcp)) {
    return in.fail("kind", "Modbus TCP has no \"" + fault.kind_name + "\"", "--modbus rtu");
  }
  if (in.has("delay_ms")) {
    if (kind->delay == std::chrono::microseconds{}) {
      return in.fail("delay_ms", "belongs to late-answer, dribble and slow");
    }
    kind->delay = microseconds(in.number("delay_ms", Range::positive(kMaxDelay_ms)));
  }
  if (!fault.for_s && fault.count == 0) fault.count = 1;
  kind->requests = fault.count;
  fault.kind = *kind;
}

void readCameraKind(JsonReader& in, ScriptedFault& fault, const FaultScriptRig& rig) {
  const auto row =
      std::find_if(kCameraFaults.begin(), kCameraFaults.end(),
                   [&](const CameraFaultRow& known) { return known.name == fault.kind_name; });
  if (row == kCameraFaults.end()) {
    return in.fail("kind", "a camera has no fault \"" + fault.kind_name + "\"",
                   listed(cameraFaultNames()));
  }
  if (fault.count != 0) in.fail("count", "this fault lasts", "for_s ends it");
  CameraFault kind{row->kind, 0.0, 0.0, (fault.device + 1) % std::max(1, rig.cameras)};
  if (kind.kind == CameraFault::Kind::kLostPackets) {
    kind.lost_share = 0.01 * in.number("lost_percent", Range::positive(100.0));
  }
  if (kind.kind == CameraFault::Kind::kDefocused) {
    kind.blur_px = in.number("blur_px", Range::positive(100.0));
  }
  if (kind.kind == CameraFault::Kind::kSwapped && in.has("with")) {
    const auto other = numberBehind(kCamera, in.text("with", kMaxName), rig.cameras);
    if (in.ok() && !other) in.fail("with", "there is no such camera");
    kind.other = other.value_or(1) - 1;
  }
  if (in.ok() && kind.kind == CameraFault::Kind::kSwapped && kind.other == fault.device) {
    in.fail("with", "must be another camera");
  }
  fault.kind = kind;
}

/// Keys that belong to one kind alone.
void refuseStrayKeys(JsonReader& in, const ScriptedFault& fault) {
  constexpr std::array<std::pair<const char*, std::string_view>, 4> kOwners{
      {{"added_N", kAddedForce},
       {"lost_percent", "lost-packets"},
       {"blur_px", "defocused"},
       {"with", "swapped"}}};
  for (const auto& [key, owner] : kOwners) {
    if (in.ok() && in.has(key) && fault.kind_name != owner) {
      in.fail(key, "belongs to " + std::string(owner));
    }
  }
  if (!fault.on_camera) return;
  for (const char* key : {"force_N", "position_m", "delay_ms"}) {
    if (in.ok() && in.has(key)) in.fail(key, "a camera has none");
  }
}

void readDelay(JsonReader& in, FaultTrigger& trigger) {
  if (!in.has("delay_s")) return;
  if (!in.json()["delay_s"].is_array()) {
    trigger.delay_min_s = trigger.delay_max_s =
        in.number("delay_s", Range::nonNegative(kMaxTime_s));
    return;
  }
  const std::vector<double> ends = in.numbers("delay_s", Range::nonNegative(kMaxTime_s));
  if (!in.ok()) return;
  if (ends.size() != 2 || ends[0] > ends[1]) {
    return in.fail("delay_s", "must be a number or [shortest, longest]");
  }
  trigger.delay_min_s = ends[0];
  trigger.delay_max_s = ends[1];
}

FaultTrigger readTrigger(JsonReader& in, const std::set<std::string>& names) {
  FaultTrigger trigger;
  int given = 0;
  for (const char* key : {"at_s", "phase", "force_N", "position_m", "after"}) {
    given += in.has(key) ? 1 : 0;
  }
  if (in.ok() && given != 1) {
    in.fail("", "exactly one of at_s, phase, force_N, position_m and after says when");
  }
  if (in.has("at_s")) trigger.at_s = in.number("at_s", Range::nonNegative(kMaxTime_s));
  if (in.has("force_N")) trigger.force_N = in.number("force_N", Range::positive(kMaxForce_N));
  if (in.has("position_m")) trigger.position_m = in.number("position_m", Range::between(-10, 10));
  if (in.has("phase")) {
    trigger.phase = findRigPhase(in.text("phase", kMaxName));
    if (in.ok() && !trigger.phase) {
      in.fail("phase", "there is no such phase",
              listed(std::vector<std::string>(kPhaseNames.begin(), kPhaseNames.end())));
    }
  }
  if (in.has("after")) {
    trigger.after = in.text("after", kMaxName);
    if (in.ok() && !names.contains(trigger.after)) {
      in.fail("after", "no fault before this one is called \"" + trigger.after + "\"");
    }
  }
  if (in.has("times")) trigger.times = static_cast<int>(in.integer("times", 0, kMaxCount));
  readDelay(in, trigger);
  return trigger;
}

ScriptedFault readFault(JsonReader in, std::size_t index, const FaultScriptRig& rig,
                        std::set<std::string>& names) {
  onlyKnownKeys(
      in,
      {"name", "device", "kind", "at_s", "phase", "force_N", "position_m", "after", "delay_s",
       "times", "count", "for_s", "delay_ms", "added_N", "lost_percent", "blur_px", "with"},
      kPage);
  ScriptedFault fault;
  fault.name = in.textOr("name", "fault-" + std::to_string(index + 1));
  readDevice(in, fault, rig);
  fault.kind_name = in.text("kind", kMaxName);
  if (in.has("for_s")) fault.for_s = in.number("for_s", Range::positive(kMaxTime_s));
  if (in.has("count")) fault.count = static_cast<int>(in.integer("count", 1, kMaxCount));
  if (in.ok() && fault.for_s && fault.count != 0) {
    in.fail("count", "either count or for_s ends a fault");
  }
  refuseStrayKeys(in, fault);
  if (in.ok() && fault.on_axis) readAxisKind(in, fault);
  if (in.ok() && fault.on_camera) readCameraKind(in, fault, rig);
  if (in.ok() && !fault.on_axis && !fault.on_camera) readCellKind(in, fault, rig.tcp);
  if (in.ok() && fault.on_axis && in.has("delay_ms") && fault.kind_name != kSlow) {
    in.fail("delay_ms", "belongs to late-answer, dribble and slow");
  }
  fault.trigger = readTrigger(in, names);
  if (in.ok() && (fault.name.empty() || fault.name.size() > kMaxName)) {
    in.fail("name", "must have 1 to 64 characters");
  }
  if (in.ok() && !names.insert(fault.name).second) in.fail("name", "another fault has it");
  return fault;
}

}  // namespace

std::string_view rigPhaseName(RigPhase phase) {
  return kPhaseNames[static_cast<std::size_t>(phase)];
}

std::optional<RigPhase> findRigPhase(std::string_view name) {
  const auto found = std::find(kPhaseNames.begin(), kPhaseNames.end(), name);
  if (found == kPhaseNames.end()) return std::nullopt;
  return static_cast<RigPhase>(found - kPhaseNames.begin());
}

std::string ScriptedFault::deviceName() const {
  const std::string_view prefix = on_axis ? "axis-" : on_camera ? kCamera : "cell-";
  return std::string(prefix) + std::to_string(device + 1);
}

std::vector<std::string> axisFaultNames() {
  std::vector<std::string> names;
  for (const VirtualFaultRow& row : virtualFaults()) names.emplace_back(row.name);
  names.emplace_back(kUnplug);
  names.emplace_back(kSlow);
  return names;
}

std::vector<std::string> cellFaultNames() {
  std::vector<std::string> names = virtualCellFaultNames();
  names.emplace_back(kAddedForce);
  return names;
}

std::vector<std::string> cameraFaultNames() {
  std::vector<std::string> names;
  for (const CameraFaultRow& row : kCameraFaults) names.emplace_back(row.name);
  return names;
}

Result<FaultScript> readFaultScript(const std::filesystem::path& file, const FaultScriptRig& rig) {
  const Result<std::string> text = readFile(file, kMaxFile_bytes);
  if (!text) return text.error();
  return parseFaultScript(*text, file.string(), rig);
}

Result<FaultScript> parseFaultScript(std::string_view toml, const std::string& file,
                                     const FaultScriptRig& rig) {
  const auto json = jsonOfToml(toml, file);
  if (!json) return json.error();
  JsonReader in(*json, file);
  onlyKnownKeys(in, {"schema_version", "seed", "fault"}, kPage);
  in.integer("schema_version", 1, 1);
  FaultScript script;
  if (in.has("seed")) script.seed = static_cast<std::uint64_t>(in.integer("seed", 0, 1LL << 52));
  const std::size_t size = in.arraySize("fault");
  if (in.ok() && (size == 0 || size > kMaxFaults))
    in.fail("fault", "must be there 1 to 1000 times");
  std::set<std::string> names;
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    script.faults.push_back(readFault(in.element("fault", i), i, rig, names));
  }
  if (!in.ok()) return in.error();
  return script;
}

}  // namespace tenter
