// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/protocol.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"
#include "tenter/core/toml_document.h"

namespace tenter {
namespace {

using Range = JsonReader::Range;

constexpr const char* kPage = "docs/formats/protocol.md";
constexpr std::size_t kMaxFile_bytes = std::size_t{1} << 20;
constexpr std::size_t kMaxName = 64, kMaxText = 1024, kMaxAxes = 64, kMaxSteps = 256;
constexpr double kMaxTravel_m = 2.0, kMaxForce_N = 1e4, kMaxSpeed_m_per_s = 0.1;
constexpr double kMaxTime_s = 86'400.0;

struct Defaults {
  std::vector<std::string> axes;
  double speed_m_per_s = 0.0;
};

void readAxes(JsonReader& in, std::vector<std::string>& axes) {
  axes = in.texts("axes");
  if (!in.ok()) return;
  const std::set<std::string> different(axes.begin(), axes.end());
  if (axes.empty() || axes.size() > kMaxAxes) in.fail("axes", "must have 1 to 64 names");
  if (different.size() != axes.size()) in.fail("axes", "names an axis twice");
}

void readForceEnd(JsonReader& in, ProtocolStep& step) {
  onlyKnownKeys(in, {"end", "axes", "speed_m_per_s", "force_N", "limit_m"}, kPage);
  step.force_N = in.number("force_N", Range::nonNegative(kMaxForce_N));
  step.limit_m = in.number("limit_m", Range::positive(kMaxTravel_m));
}

void readTravelEnd(JsonReader& in, ProtocolStep& step) {
  onlyKnownKeys(in, {"end", "speed_m_per_s", "targets_m"}, kPage);
  JsonReader targets = in.object("targets_m");
  if (!in.ok()) return;
  step.axes.clear();
  for (const auto& [axis, value] : targets.json().items()) {
    step.axes.push_back(axis);
    step.targets_m.push_back(targets.number(axis, Range::between(-kMaxTravel_m, kMaxTravel_m)));
  }
  if (step.axes.empty() || step.axes.size() > kMaxAxes) {
    in.fail("targets_m", "must have 1 to 64 axes");
  }
}

void readHoldEnd(JsonReader& in, ProtocolStep& step) {
  onlyKnownKeys(in, {"end", "hold_s"}, kPage);
  step.axes.clear();
  step.hold_s = in.number("hold_s", Range::positive(kMaxTime_s));
}

struct EndRow {
  std::string_view name;
  StepEnd end;
  void (*read)(JsonReader&, ProtocolStep&);
};
constexpr std::array kEnds{EndRow{"force", StepEnd::kForce, readForceEnd},
                           EndRow{"travel", StepEnd::kTravel, readTravelEnd},
                           EndRow{"hold", StepEnd::kHold, readHoldEnd}};

ProtocolStep readStep(JsonReader in, const Defaults& defaults) {
  ProtocolStep step;
  const std::string end = in.text("end", kMaxName);
  if (!in.ok()) return step;
  const auto row =
      std::find_if(kEnds.begin(), kEnds.end(), [&](const EndRow& r) { return r.name == end; });
  if (row == kEnds.end()) {
    in.fail("end", "\"" + end + "\" is not known", "one of: force, travel, hold");
    return step;
  }
  step.end = row->end;
  step.axes = defaults.axes;
  if (in.has("axes")) readAxes(in, step.axes);
  step.speed_m_per_s =
      in.numberOr("speed_m_per_s", defaults.speed_m_per_s, Range::positive(kMaxSpeed_m_per_s));
  row->read(in, step);
  return step;
}

ProtocolPhase readPhase(JsonReader in, Defaults defaults) {
  onlyKnownKeys(in, {"name", "cycles", "speed_m_per_s", "step"}, kPage);
  defaults.speed_m_per_s =
      in.numberOr("speed_m_per_s", defaults.speed_m_per_s, Range::positive(kMaxSpeed_m_per_s));
  ProtocolPhase phase;
  phase.name = in.text("name", kMaxName);
  if (in.has("cycles")) phase.cycles = static_cast<int>(in.integer("cycles", 1, 1000));
  const std::size_t size = in.arraySize("step");
  if (in.ok() && (size == 0 || size > kMaxSteps)) in.fail("step", "must be there 1 to 256 times");
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    phase.steps.push_back(readStep(in.element("step", i), defaults));
  }
  return phase;
}

std::string complaint(const ProtocolStep& step, const RigConfig& rig) {
  double together_m_per_s = 0.0;
  for (std::size_t i = 0; i < step.axes.size(); ++i) {
    const auto found = rig.findAxis(step.axes[i]);
    if (!found) return "the rig has no axis \"" + step.axes[i] + "\"";
    const RigAxis& axis = rig.axes[static_cast<std::size_t>(*found)];
    if (step.end == StepEnd::kForce && !axis.cell) {
      return "axis " + step.axes[i] + " has no cell that could end the step";
    }
    if (step.speed_m_per_s > axis.device.max_speed_m_per_s) {
      return "axis " + step.axes[i] + " goes no faster than " +
             std::to_string(axis.device.max_speed_m_per_s) + " m/s";
    }
    const double stroke_m = axis.device.travel_max_m - axis.device.travel_min_m;
    if (!step.targets_m.empty() && std::abs(step.targets_m[i]) > stroke_m) {
      return "axis " + step.axes[i] + " has only " + std::to_string(stroke_m) + " m of travel";
    }
    together_m_per_s += step.speed_m_per_s;
  }
  const double cap_m_per_s = speedCap_m_per_s(rig.limits);
  if (together_m_per_s > cap_m_per_s) {
    return "its axes together go " + std::to_string(together_m_per_s) +
           " m/s, above the speed cap of " + std::to_string(cap_m_per_s) + " m/s";
  }
  if (step.force_N > rig.limits.working_N) {
    return "force_N is above the working force of " + std::to_string(rig.limits.working_N) + " N";
  }
  return "";
}

}  // namespace

Result<CaptureProtocol> readCaptureProtocol(const std::filesystem::path& file) {
  const Result<std::string> text = readFile(file, kMaxFile_bytes);
  if (!text) return text.error();
  return parseCaptureProtocol(*text, file.string());
}

Result<CaptureProtocol> parseCaptureProtocol(std::string_view toml, const std::string& file) {
  const auto json = jsonOfToml(toml, file);
  if (!json) return json.error();
  JsonReader in(*json, file);
  onlyKnownKeys(in,
                {"schema_version", "name", "description", "axes", "speed_m_per_s",
                 "capture_interval_s", "phase"},
                kPage);
  in.integer("schema_version", 1, 1);
  CaptureProtocol protocol;
  protocol.text = toml;
  protocol.name = in.text("name", kMaxName);
  protocol.description = in.text("description", kMaxText);
  Defaults defaults;
  readAxes(in, defaults.axes);
  defaults.speed_m_per_s = in.number("speed_m_per_s", Range::positive(kMaxSpeed_m_per_s));
  protocol.capture_interval_s = in.number("capture_interval_s", Range::between(0.02, kMaxTime_s));
  const std::size_t size = in.arraySize("phase");
  if (in.ok() && (size == 0 || size > kMaxSteps)) in.fail("phase", "must be there 1 to 256 times");
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    protocol.phases.push_back(readPhase(in.element("phase", i), defaults));
  }
  if (!in.ok()) return in.error();
  return protocol;
}

Result<void> checkAgainstRig(const CaptureProtocol& protocol, const RigConfig& rig) {
  for (const ProtocolPhase& phase : protocol.phases) {
    for (std::size_t i = 0; i < phase.steps.size(); ++i) {
      const std::string wrong = complaint(phase.steps[i], rig);
      if (wrong.empty()) continue;
      return Error{ErrorKind::kInterlock, protocol.name,
                   "phase " + phase.name + ", step " + std::to_string(i), wrong, ""};
    }
  }
  return {};
}

}  // namespace tenter
