// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/rig_journal.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "rig_journal_kinds.h"

namespace tenter {
namespace {

using Json = nlohmann::ordered_json;

std::string dumped(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json numberOrNull(const std::optional<double>& value) {
  Json out;
  if (value) out = *value;
  return out;
}

Json axisJson(const AxisInput& axis) {
  return {{"energised", axis.energised},
          {"certain", axis.position_certain},
          {"homing", axis.homing},
          {"fault", axis.fault}};
}

TensionReading tensionOf(const CellInput& cell) {
  TensionReading out{cell.gross_N, TensionStatus::kOk, std::max<std::int64_t>(0, cell.age_ns)};
  if (cell.gross_N) return out;
  out.status = cell.fault == "stale"        ? TensionStatus::kStale
               : cell.fault == "over-range" ? TensionStatus::kOverRange
               : cell.fault == "never-read" ? TensionStatus::kMissing
                                            : TensionStatus::kFault;
  return out;
}

std::string stateOf(const RigTick& tick) {
  Json axes = Json::array(), cells = Json::array();
  for (const AxisInput& axis : tick.axes) axes.push_back(axisJson(axis));
  for (const CellInput& cell : tick.cells) cells.push_back(cell.fault);
  return dumped({{"axes", axes},
                 {"cells", cells},
                 {"emergency_stop", tick.emergency_stop},
                 {"operator_gone", tick.operator_gone},
                 {"recorder_fault", tick.recorder_fault}});
}

}  // namespace

RecordBody RigJournal::memoryRecord(const RigMemory& memory, std::int64_t zero_ns) {
  Json axes = Json::array(), heard = Json::array(), felt = Json::array(), last;
  for (std::size_t i = 0; i < memory.axes.size(); ++i) {
    Json axis = axisJson(memory.axes[i]);
    axis["position_m"] = numberOrNull(memory.axes[i].position_m);
    axes.push_back(axis);
    Json heard_ns;
    if (memory.heard_ns[i]) heard_ns = *memory.heard_ns[i] - zero_ns;
    heard.push_back(heard_ns);
  }
  for (const std::int64_t felt_ns : memory.felt_ns) felt.push_back(felt_ns - zero_ns);
  if (memory.last_ns) last = *memory.last_ns - zero_ns;
  return GenericRecord{rig_journal::kMemory, dumped({{"monotonic_ns", zero_ns},
                                                     {"state", rigStateName(memory.state)},
                                                     {"reason", memory.reason},
                                                     {"enabled", memory.enabled},
                                                     {"emergency", memory.emergency},
                                                     {"blind", memory.blind},
                                                     {"last_ns", last},
                                                     {"axes", axes},
                                                     {"heard_ns", heard},
                                                     {"known_m", memory.known_m},
                                                     {"felt_ns", felt},
                                                     {"tares_N", memory.tares_N},
                                                     {"mapped", memory.mapped},
                                                     {"origins_m", memory.origins_m}})};
}

std::vector<RecordBody> RigJournal::tickRecords(const RigTick& tick) {
  std::vector<RecordBody> records;
  std::string state = stateOf(tick);
  if (state != last_) {
    records.emplace_back(GenericRecord{rig_journal::kInput, state});
    last_ = std::move(state);
  }
  if (tick.halted_outside || tick.trip) {
    Json trip;
    if (tick.trip) trip = Json{{"cell", tick.trip->cell}, {"gross_N", tick.trip->gross_N}};
    records.emplace_back(GenericRecord{
        rig_journal::kHalt, dumped({{"halted_outside", tick.halted_outside}, {"trip", trip}})});
  }
  for (const RigCommand& command : tick.commands) {
    records.emplace_back(GenericRecord{
        rig_journal::kCommand,
        dumped(
            {{"command", rigCommandName(command.kind)},
             {"axis", command.axis},
             {"distance_m", command.distance_m},
             {"speed_m_per_s", command.speed_m_per_s},
             {"mapping", rig_journal::kMappingNames[static_cast<std::size_t>(command.mapping)]}})});
  }
  SampleRecord sample;
  for (const AxisInput& axis : tick.axes) sample.positions_m.push_back(axis.position_m);
  for (const CellInput& cell : tick.cells) sample.tensions.push_back(tensionOf(cell));
  records.emplace_back(std::move(sample));
  return records;
}

}  // namespace tenter
