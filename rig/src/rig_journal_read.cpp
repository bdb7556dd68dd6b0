// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "rig_journal_kinds.h"
#include "tenter/core/json_reader.h"
#include "tenter/rig/rig_journal.h"

namespace tenter {
namespace {

using Range = JsonReader::Range;

constexpr std::int64_t kMost_ns = std::int64_t{1} << 62;
constexpr std::size_t kMaxText = 4096;

constexpr const char* kFile = "journal.jsonl";

std::string placeOf(const JournalRecord& record) {
  return "record " + std::to_string(record.sequence) + ", data";
}

Result<nlohmann::json> jsonOf(const JournalRecord& record, const std::string& data) {
  return parseJson(data, kFile, placeOf(record));
}

bool isThere(const JsonReader& in, const std::string& key) {
  return in.has(key) && !in.json()[key].is_null();
}

AxisInput readAxis(JsonReader in, bool with_position) {
  AxisInput axis;
  axis.energised = in.boolean("energised");
  axis.position_certain = in.boolean("certain");
  axis.homing = in.boolean("homing");
  axis.fault = in.text("fault", kMaxText);
  if (with_position && isThere(in, "position_m")) axis.position_m = in.number("position_m");
  return axis;
}

std::vector<AxisInput> readAxes(JsonReader& in, std::size_t size, bool with_positions) {
  std::vector<AxisInput> axes;
  const std::size_t found = in.arraySize("axes");
  if (in.ok() && found != size) in.fail("axes", "is not one for each axis of the rig");
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    axes.push_back(readAxis(in.element("axes", i), with_positions));
  }
  return axes;
}

/// Whole numbers, or nothing where null.
std::vector<std::optional<std::int64_t>> readTimes(JsonReader& in, const std::string& key,
                                                   std::size_t size) {
  std::vector<std::optional<std::int64_t>> times;
  if (in.arraySize(key) != size && in.ok()) in.fail(key, "has the wrong length");
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    const nlohmann::json& value = in.json()[key][i];
    if (!value.is_null() && !value.is_number_integer()) in.fail(key, "must be whole numbers");
    times.push_back(value.is_number_integer() ? std::optional(value.get<std::int64_t>())
                                              : std::nullopt);
    if (times.back() && (*times.back() < -kMost_ns || *times.back() > kMost_ns))
      in.fail(key, "is beyond all times");
  }
  return times;
}

/// Sessions from before the mapping was checked do not have it.
std::vector<bool> readMapped(JsonReader& in, std::size_t size) {
  std::vector<bool> mapped(size, false);
  if (!in.has("mapped")) return mapped;
  if (in.arraySize("mapped") != size && in.ok()) in.fail("mapped", "has the wrong length");
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    const nlohmann::json& value = in.json()["mapped"][i];
    if (!value.is_boolean()) in.fail("mapped", "must be true or false for each axis");
    mapped[i] = value == true;
  }
  return mapped;
}

std::vector<double> readNumbers(JsonReader& in, const std::string& key, std::size_t size) {
  std::vector<double> numbers = in.numbers(key);
  if (in.ok() && numbers.size() != size) in.fail(key, "has the wrong length");
  return numbers;
}

}  // namespace

Result<bool> RigJournalReader::take(const JournalRecord& record) {
  using Take = Result<void> (RigJournalReader::*)(const JournalRecord&, const std::string&);
  struct Row {
    const char* kind;
    Take take;
  };
  static constexpr Row kRows[] = {{rig_journal::kMemory, &RigJournalReader::takeMemory},
                                  {rig_journal::kInput, &RigJournalReader::takeInput},
                                  {rig_journal::kHalt, &RigJournalReader::takeHalt},
                                  {rig_journal::kCommand, &RigJournalReader::takeCommand}};
  const auto* generic = std::get_if<GenericRecord>(&record.body);
  if (generic == nullptr) return false;
  for (const Row& row : kRows) {
    if (generic->kind != row.kind) continue;
    if (auto done = (this->*row.take)(record, generic->data); !done) return done.error();
    return true;
  }
  return false;
}

Result<void> RigJournalReader::takeMemory(const JournalRecord& record, const std::string& data) {
  const auto json = jsonOf(record, data);
  if (!json) return json.error();
  JsonReader in(*json, kFile, placeOf(record));
  const std::size_t axes = config_.axes.size(), cells = config_.cells.size();
  RigMemory memory;
  const auto state = findRigState(in.text("state", kMaxText));
  if (in.ok() && !state) in.fail("state", "is no state of the rig");
  memory.state = state.value_or(RigState::kOff);
  memory.reason = in.text("reason", kMaxText);
  memory.enabled = in.boolean("enabled");
  memory.emergency = in.boolean("emergency");
  memory.blind = in.boolean("blind");
  if (isThere(in, "last_ns")) memory.last_ns = in.integer("last_ns", -kMost_ns, kMost_ns);
  memory.axes = readAxes(in, axes, true);
  memory.heard_ns = readTimes(in, "heard_ns", axes);
  for (const auto& felt_ns : readTimes(in, "felt_ns", cells)) {
    memory.felt_ns.push_back(felt_ns.value_or(-kMost_ns));
  }
  memory.known_m = readNumbers(in, "known_m", axes);
  memory.tares_N = readNumbers(in, "tares_N", cells);
  memory.mapped = readMapped(in, axes);
  // Older sessions do not have it: their runs began where the axes stood.
  memory.origins_m = in.has("origins_m") ? readNumbers(in, "origins_m", axes) : memory.known_m;
  if (!in.ok()) return in.error();
  memory_ = std::move(memory);
  return {};
}

Result<void> RigJournalReader::takeInput(const JournalRecord& record, const std::string& data) {
  const auto json = jsonOf(record, data);
  if (!json) return json.error();
  JsonReader in(*json, kFile, placeOf(record));
  std::vector<AxisInput> axes = readAxes(in, config_.axes.size(), false);
  const std::vector<std::string> cells = in.texts("cells");
  if (in.ok() && cells.size() != config_.cells.size()) in.fail("cells", "has the wrong length");
  const bool emergency_stop = in.boolean("emergency_stop");
  const bool operator_gone = in.boolean("operator_gone");
  const std::string recorder_fault = in.text("recorder_fault", kMaxText);
  if (!in.ok()) return in.error();
  tick_.axes = std::move(axes);
  tick_.cells.resize(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) tick_.cells[i].fault = cells[i];
  tick_.emergency_stop = emergency_stop;
  tick_.operator_gone = operator_gone;
  tick_.recorder_fault = recorder_fault;
  return {};
}

Result<void> RigJournalReader::takeHalt(const JournalRecord& record, const std::string& data) {
  const auto json = jsonOf(record, data);
  if (!json) return json.error();
  JsonReader in(*json, kFile, placeOf(record));
  const bool halted_outside = in.boolean("halted_outside");
  std::optional<ForceTrip> trip;
  if (isThere(in, "trip")) {
    JsonReader inner = in.object("trip");
    const auto last = static_cast<std::int64_t>(config_.cells.size()) - 1;
    trip = ForceTrip{static_cast<int>(inner.integer("cell", 0, last)), inner.number("gross_N")};
  }
  if (!in.ok()) return in.error();
  tick_.halted_outside = halted_outside;
  tick_.trip = trip;
  return {};
}

Result<void> RigJournalReader::takeCommand(const JournalRecord& record, const std::string& data) {
  const auto json = jsonOf(record, data);
  if (!json) return json.error();
  JsonReader in(*json, kFile, placeOf(record));
  const auto kind = findRigCommand(in.text("command", kMaxText));
  if (in.ok() && !kind) in.fail("command", "is no command of the rig");
  RigCommand command;
  command.kind = kind.value_or(RigCommand::Kind::kStop);
  command.axis = static_cast<int>(in.integer("axis", -1, 1 << 20));
  command.distance_m = in.number("distance_m");
  command.speed_m_per_s = in.number("speed_m_per_s");
  if (in.has("mapping")) {
    const auto& names = rig_journal::kMappingNames;
    const auto name = std::find(names.begin(), names.end(), in.text("mapping", kMaxText));
    if (in.ok() && name == names.end()) in.fail("mapping", "must be unasked, check or skip");
    if (in.ok()) command.mapping = static_cast<RigCommand::Mapping>(name - names.begin());
  }
  if (command.kind == RigCommand::Kind::kRun) command.protocol = protocol_;
  if (!in.ok()) return in.error();
  tick_.commands.push_back(std::move(command));
  return {};
}

RigTick RigJournalReader::tickOf(const SampleRecord& sample, std::int64_t time_ns) {
  tick_.time_ns = time_ns;
  tick_.axes.resize(sample.positions_m.size());
  tick_.cells.resize(sample.tensions.size());
  for (std::size_t i = 0; i < tick_.axes.size(); ++i) {
    tick_.axes[i].position_m = sample.positions_m[i];
  }
  for (std::size_t i = 0; i < tick_.cells.size(); ++i) {
    tick_.cells[i].gross_N = sample.tensions[i].tension_N;
    tick_.cells[i].age_ns = sample.tensions[i].age_ns;
  }
  RigTick tick = tick_;
  tick_.commands.clear();
  tick_.halted_outside = false;
  tick_.trip.reset();
  return tick;
}

}  // namespace tenter
