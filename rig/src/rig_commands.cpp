// SPDX-License-Identifier: GPL-3.0-or-later
// What a person may ask for, and why not; rig_motion.cpp has what is done.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tenter/rig/rig_machine.h"

namespace tenter {
namespace {

using Kind = RigCommand::Kind;

constexpr std::array<std::string_view, 13> kCommandNames{
    "enable", "disable", "home", "tare",  "jog",    "run",          "pause",
    "resume", "abort",   "stop", "reset", "unload", "check-mapping"};

}  // namespace

std::string_view rigCommandName(RigCommand::Kind kind) {
  return kCommandNames[static_cast<std::size_t>(kind)];
}

std::optional<RigCommand::Kind> findRigCommand(std::string_view name) {
  const auto found = std::find(kCommandNames.begin(), kCommandNames.end(), name);
  if (found == kCommandNames.end()) return std::nullopt;
  return static_cast<Kind>(found - kCommandNames.begin());
}

void RigMachine::obey(const RigCommand& command) {
  const std::string refusal = refusalOf(command);
  const std::string_view name = rigCommandName(command.kind);
  orders_->answers.push_back({command.id, refusal});
  orders_->records.emplace_back(
      OperatorEvent{std::string(name), refusal.empty() ? "" : "refused: " + refusal});
  if (refusal.empty()) carryOut(command);
}

std::string RigMachine::refusalOf(const RigCommand& command) const {
  const bool idle = activity_ == Activity::kNone;
  const bool calm = idle && (state_ == RigState::kReady || state_ == RigState::kCaution);
  const bool halted = idle && (state_ == RigState::kFault || state_ == RigState::kStopped);
  const std::string no = "the rig is " + std::string(rigStateName(state_)) +
                         (reason_.empty() ? "" : " (" + reason_ + ")");
  if (emergency_ && command.kind != Kind::kStop) return "the emergency stop is pressed";
  switch (command.kind) {
    case Kind::kEnable:
      return state_ == RigState::kOff ? "" : no;
    case Kind::kDisable:
      return calm || halted ? "" : no;
    case Kind::kTare:
      return calm ? "" : no;
    case Kind::kUnload:
      return calm || halted ? "" : no;
    case Kind::kReset:
      return calm || halted ? "" : no;
    case Kind::kPause:
      return activity_ == Activity::kRun && state_ == RigState::kRunning ? "" : no;
    case Kind::kResume:
      return state_ == RigState::kPaused ? "" : no;
    case Kind::kAbort:
      return idle ? no : "";
    case Kind::kStop:
      return "";
    case Kind::kJog:
      return calm || halted ? refusalOfJog(command) : no;
    case Kind::kRun:
      return state_ == RigState::kReady && idle ? refusalOfRun(command) : no;
    case Kind::kCheckMapping:
      return state_ == RigState::kReady && idle ? refusalOfMapping(command) : no;
    case Kind::kHome:
      break;
  }
  return calm ? refusalOfHome() : no;
}

/// Homing is for slack cords. An axis that lost its count, as a device does without power, may
/// count no way left though its cord pulls, and only homing lets that out; cords whose axes stand
/// at their ends may pull along with it.
std::string RigMachine::refusalOfHome() const {
  std::string loaded;
  bool any_lost = false;
  for (std::size_t i = 0; i < config_.cells.size(); ++i) {
    const std::string& name = config_.cells[i].id;
    const auto tension_N = net_N(i);
    if (!tension_N) return name + " gives no tension";
    if (*tension_N <= config_.limits.slack_N) continue;
    const std::optional<std::size_t> axis = axisAtItsEnd(static_cast<int>(i));
    if (!axis) return name + " is under load: unload first";
    any_lost = any_lost || !axes_[*axis].position_certain;
    loaded = name;
  }
  return loaded.empty() || any_lost ? "" : loaded + " is under load: unload first";
}

/// The axis of a cell, if by its count it cannot let out any more.
std::optional<std::size_t> RigMachine::axisAtItsEnd(int cell) const {
  for (std::size_t i = 0; i < config_.axes.size(); ++i) {
    if (config_.axes[i].cell != cell) continue;
    const double end_m = config_.axes[i].device.travel_min_m + config_.limits.following_error_m;
    if (known_m_[i] <= end_m) return i;
  }
  return std::nullopt;
}

std::string RigMachine::refusalOfJog(const RigCommand& command) const {
  if (command.axis < 0 || command.axis >= static_cast<int>(config_.axes.size())) {
    return "there is no such axis";
  }
  const auto index = static_cast<std::size_t>(command.axis);
  const AxisConfig& axis = config_.axes[index].device;
  if (!std::isfinite(command.distance_m) || command.distance_m == 0.0)
    return "the distance is none";
  if (!(command.speed_m_per_s > 0.0 && command.speed_m_per_s <= axis.max_speed_m_per_s)) {
    return "the speed must be above 0 and at most " + std::to_string(axis.max_speed_m_per_s) +
           " m/s";
  }
  if (!axes_[index].position_m || !axes_[index].energised) {
    return "axis " + axis.name + " does not answer or has no current";
  }
  const double target_m = known_m_[index] + command.distance_m;
  if (command.distance_m > 0.0) {
    if (state_ != RigState::kReady) {
      return "only moves that unload are allowed now (" + reason_ + ")";
    }
    if (target_m > axis.travel_max_m) return "it would leave the axis' travel";
  } else if (target_m < axis.travel_min_m) {
    return "it would leave the axis' travel";
  }
  return "";
}

std::string RigMachine::refusalOfMapping(const RigCommand& command) const {
  bool any = false;
  for (const RigAxis& axis : config_.axes) any = any || axis.cell.has_value();
  if (!any) return "no axis has a cell";
  for (const int axis : command.axes) {
    if (axis < 0 || axis >= static_cast<int>(config_.axes.size())) return "there is no such axis";
    const RigAxis& known = config_.axes[static_cast<std::size_t>(axis)];
    if (!known.cell) return known.device.name + " has no cell";
  }
  return "";
}

std::string RigMachine::refusalOfRun(const RigCommand& command) const {
  if (!command.protocol) return "there is no protocol";
  const Result<void> fits = checkAgainstRig(*command.protocol, config_);
  return fits ? "" : fits.error().message();
}

/// Of a command that takes time: its end is told apart from that of the one before.
void RigMachine::setOut(Kind kind) {
  const bool takes_time = kind == Kind::kHome || kind == Kind::kTare || kind == Kind::kJog ||
                          kind == Kind::kRun || kind == Kind::kUnload ||
                          kind == Kind::kCheckMapping;
  if (takes_time) purpose_ = {purpose_.number + 1, std::string(rigCommandName(kind)), "", ""};
}

void RigMachine::carryOut(const RigCommand& command) {
  const auto axis = static_cast<std::size_t>(command.axis);
  setOut(command.kind);
  switch (command.kind) {
    case Kind::kEnable:
      enabled_ = true;
      disabling_ = false;
      orders_->energise = orders_->release_halt = true;
      return;
    case Kind::kDisable:
      enabled_ = false;
      disabling_ = true;
      orders_->deenergise = true;
      return changeState(RigState::kOff, "disabled");
    case Kind::kHome:
      orders_->home = orders_->release_halt = true;
      changeState(RigState::kRunning, "homing");
      return begin(Activity::kHome);
    case Kind::kTare:
      tare_sums_N_.assign(config_.cells.size(), 0.0);
      tare_lowest_N_.assign(config_.cells.size(), std::numeric_limits<double>::infinity());
      tare_highest_N_.assign(config_.cells.size(), -std::numeric_limits<double>::infinity());
      tare_ticks_ = 0;
      return begin(Activity::kTare);
    case Kind::kJog:
      begin(Activity::kJog);
      orders_->release_halt = true;
      jog_axis_ = command.axis;
      jog_speed_m_per_s_ = command.speed_m_per_s;
      jog_target_m_ =
          std::clamp(known_m_[axis] + command.distance_m, config_.axes[axis].device.travel_min_m,
                     config_.axes[axis].device.travel_max_m);
      loading_ = command.distance_m > 0.0;
      if (state_ == RigState::kReady || state_ == RigState::kCaution) {
        changeState(RigState::kRunning, "jog");
      }
      return;
    case Kind::kRun:
      protocol_ = command.protocol;
      recording_ = orders_->release_halt = true;
      if (command.mapping != RigCommand::Mapping::kUnasked) {
        const std::vector<int> axes = axesToMap(*protocol_);
        const bool skip = command.mapping == RigCommand::Mapping::kSkip;
        if (!axes.empty() && !skip) return startMapping(axes);
        if (!axes.empty()) decide("mapping-check-skipped");
      }
      return startProtocol();
    case Kind::kCheckMapping:
      orders_->release_halt = true;
      return startMapping(command.axes);
    case Kind::kPause:
      paused_since_ns_ = tick_->time_ns;
      return changeState(RigState::kPaused, "paused");
    case Kind::kResume: {
      const std::int64_t paused_ns = tick_->time_ns - paused_since_ns_;
      step_since_ns_ += paused_ns;
      next_capture_ns_ += paused_ns;
      return changeState(RigState::kRunning, "protocol " + protocol_->name);
    }
    case Kind::kAbort:
      conclude("aborted", "aborted");
      if (activity_ == Activity::kTare) {
        activity_ = Activity::kNone;  // nothing moved
        return;
      }
      endRun("aborted");
      orders_->halt = true;
      loading_ = false;
      changeState(state_ == RigState::kPaused ? RigState::kRunning : state_, "aborted");
      return begin(Activity::kSettle);
    case Kind::kStop:
      return stop("operator's stop", true);
    case Kind::kReset:
      orders_->energise = orders_->release_halt = true;
      return changeState(RigState::kCaution, "reset");
    case Kind::kUnload:
      if (state_ == RigState::kReady || state_ == RigState::kCaution) {
        changeState(RigState::kRunning, "unloading");
      }
      return startUnloading();
  }
}

}  // namespace tenter
