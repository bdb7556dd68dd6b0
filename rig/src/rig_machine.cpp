// SPDX-License-Identifier: GPL-3.0-or-later
// What must not be, and what a person may ask for; rig_motion.cpp has what is done.
#include "tenter/rig/rig_machine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace tenter {
namespace {

using Kind = RigCommand::Kind;

/// An axis that merely answers late keeps its last reading for so long: half of what its device
/// waits for orders before it halts by itself.
constexpr std::int64_t kSilence_ns = 100'000'000;
/// A question that a halt cut short is as good as one that was answered late.
bool isLate(std::string_view fault) { return fault == "timeout" || fault == "preempted"; }

constexpr std::size_t kSlopeTicks = 5;  // a slope over one tick would be the cell's noise
constexpr std::array<std::string_view, 7> kStateNames{"off",    "ready", "caution", "running",
                                                      "paused", "fault", "stopped"};
constexpr std::array<std::string_view, 13> kCommandNames{
    "enable", "disable", "home", "tare",  "jog",    "run",          "pause",
    "resume", "abort",   "stop", "reset", "unload", "check-mapping"};

std::string newtons(double force_N) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f N", force_N);
  return text;
}

}  // namespace

std::string_view rigStateName(RigState state) {
  return kStateNames[static_cast<std::size_t>(state)];
}

std::optional<RigState> findRigState(std::string_view name) {
  const auto found = std::find(kStateNames.begin(), kStateNames.end(), name);
  if (found == kStateNames.end()) return std::nullopt;
  return static_cast<RigState>(found - kStateNames.begin());
}

std::string_view rigCommandName(RigCommand::Kind kind) {
  return kCommandNames[static_cast<std::size_t>(kind)];
}

std::optional<RigCommand::Kind> findRigCommand(std::string_view name) {
  const auto found = std::find(kCommandNames.begin(), kCommandNames.end(), name);
  if (found == kCommandNames.end()) return std::nullopt;
  return static_cast<Kind>(found - kCommandNames.begin());
}

RigMachine::RigMachine(RigConfig config)
    : config_(std::move(config)), cap_m_per_s_(speedCap_m_per_s(config_.limits)) {
  setpoints_m_.resize(config_.axes.size());
  origins_m_.resize(config_.axes.size());
  axes_.resize(config_.axes.size());
  heard_ns_.resize(config_.axes.size());
  felt_ns_.resize(config_.cells.size());
  begun_m_.resize(config_.axes.size());
  known_m_.resize(config_.axes.size());
  tares_N_.resize(config_.cells.size());
  mapped_.resize(config_.axes.size());
}

RigMachine::RigMachine(RigConfig config, const RigMemory& memory) : RigMachine(std::move(config)) {
  require(memory.axes.size() == axes_.size() && memory.heard_ns.size() == axes_.size() &&
              memory.known_m.size() == axes_.size() && memory.felt_ns.size() == felt_ns_.size() &&
              memory.tares_N.size() == tares_N_.size() && memory.mapped.size() == mapped_.size(),
          "RigMachine: a memory of this rig");
  state_ = memory.state;
  reason_ = memory.reason;
  enabled_ = memory.enabled;
  emergency_ = memory.emergency;
  blind_ = memory.blind;
  last_ns_ = memory.last_ns;
  axes_ = memory.axes;
  heard_ns_ = memory.heard_ns;
  known_m_ = memory.known_m;
  felt_ns_ = memory.felt_ns;
  tares_N_ = memory.tares_N;
  mapped_ = memory.mapped;
}

RigMemory RigMachine::memory() const {
  return {state_, reason_,   enabled_, emergency_, blind_,   last_ns_,
          axes_,  heard_ns_, known_m_, felt_ns_,   tares_N_, mapped_};
}

RigOrders RigMachine::step(const RigTick& tick) {
  require(tick.axes.size() == config_.axes.size() && tick.cells.size() == config_.cells.size(),
          "RigMachine: one input for each axis and cell");
  RigOrders orders;
  orders.targets_m.resize(config_.axes.size());
  orders.speeds_m_per_s.resize(config_.axes.size());
  goals_m_.assign(config_.axes.size(), std::nullopt);
  tick_ = &tick;
  orders_ = &orders;
  remember();
  watch();
  for (const RigCommand& command : tick.commands) obey(command);
  act();
  settleIdleState();
  if (orders.halt) orders.targets_m.assign(config_.axes.size(), std::nullopt);
  last_ns_ = tick.time_ns;
  tick_ = nullptr;
  orders_ = nullptr;
  return orders;
}

void RigMachine::remember() {
  const std::int64_t passed_ns = last_ns_ ? tick_->time_ns - *last_ns_ : 0;
  dt_s_ = 1e-9 * static_cast<double>(std::clamp<std::int64_t>(passed_ns, 0, kLateTick_ns));
  for (std::size_t i = 0; i < known_m_.size(); ++i) {
    const AxisInput& input = tick_->axes[i];
    const bool late = !input.position_m && isLate(input.fault) && heard_ns_[i] &&
                      tick_->time_ns - *heard_ns_[i] <= kSilence_ns;
    if (!late) axes_[i] = input;
    // Whoever takes hold of plugs may put them elsewhere.
    if (!axes_[i].position_m || !axes_[i].energised) mapped_[i] = false;
    if (input.position_m) heard_ns_[i] = tick_->time_ns;
    if (axes_[i].position_m) known_m_[i] = *axes_[i].position_m;
  }
  for (std::size_t i = 0; i < felt_ns_.size(); ++i) {
    const CellInput& cell = tick_->cells[i];
    if (cell.gross_N && cell.age_ns <= kStale_ns) felt_ns_[i] = tick_->time_ns;
  }
  std::vector<std::optional<double>> forces;
  for (const CellInput& cell : tick_->cells) forces.push_back(cell.gross_N);
  history_N_.push_back(std::move(forces));
  history_ns_.push_back(tick_->time_ns);
  if (history_N_.size() > kSlopeTicks + 1) {
    history_N_.pop_front();
    history_ns_.pop_front();
  }
  if (passed_ns > kLateTick_ns && moving()) {
    trip("loop", "late-tick", "the loop was held up for more than 200 ms");
  }
}

bool RigMachine::axesFit() const {
  return std::all_of(axes_.begin(), axes_.end(), [](const AxisInput& axis) {
    return axis.energised && axis.fault.empty() && axis.position_m;
  });
}

void RigMachine::watch() {
  if (tick_->emergency_stop && !emergency_) {
    const bool was_moving = moving();
    stop("emergency stop", true);
    if (was_moving) decide("not-unloaded", R"({"why":"emergency stop"})");
  }
  emergency_ = tick_->emergency_stop;
  if (tick_->halted_outside) stop("operator's stop", false);
  if (state_ == RigState::kOff) {
    if (enabled_ && !emergency_ && axesFit()) changeState(RigState::kCaution, "enabled");
    return;
  }
  watchForces();
  if (moving()) watchAxes();
  if (moving()) watchLoading();
  if (activity_ != Activity::kNone && state_ != RigState::kFault) {
    if (tick_->operator_gone) trip("operator", "lease-lost", "the operator's program is gone");
    if (recording_ && !tick_->recorder_fault.empty()) {
      trip("session", "not-written", tick_->recorder_fault);
    }
  }
}

void RigMachine::watchForces() {
  const bool yields = state_ == RigState::kFault || (state_ == RigState::kStopped && !loading_);
  for (std::size_t i = 0; i < config_.cells.size() && !yields; ++i) {
    const auto& gross_N = tick_->cells[i].gross_N;
    if (gross_N && *gross_N > config_.limits.absolute_N) {
      return trip(config_.cells[i].id, "absolute-force", newtons(*gross_N));
    }
  }
  if (tick_->trip && !yields) {
    trip(config_.cells.at(static_cast<std::size_t>(tick_->trip->cell)).id, "absolute-force",
         newtons(tick_->trip->gross_N));
  }
}

/// Of motions that may raise a tension.
void RigMachine::watchLoading() {
  blind_ = false;
  if (!loading_) return;
  const double span_s = 1e-9 * static_cast<double>(history_ns_.back() - history_ns_.front());
  for (std::size_t i = 0; i < config_.cells.size(); ++i) {
    const CellInput& cell = tick_->cells[i];
    const std::string& name = config_.cells[i].id;
    if (!cell.gross_N || cell.age_ns > kStale_ns) {
      blind_ = true;
      if (tick_->time_ns - felt_ns_[i] <= kSilence_ns) continue;
      return trip(name, cell.fault.empty() ? "stale" : cell.fault, "no tension to go by");
    }
    if (*cell.gross_N > config_.limits.working_N) {
      return trip(name, "working-force", newtons(*cell.gross_N));
    }
    const auto& before_N = history_N_.front()[i];
    if (history_N_.size() > kSlopeTicks && before_N && span_s > 0.0 &&
        std::abs(*cell.gross_N - *before_N) > config_.limits.slope_N_per_s * span_s) {
      return trip(name, "force-slope",
                  newtons(*cell.gross_N - *before_N) + " in a tenth of a second");
    }
  }
}

/// Not where it was sent. Whoever begins beyond the travel is not behind for coming back.
bool RigMachine::strays(std::size_t axis) const {
  const AxisConfig& device = config_.axes[axis].device;
  const double allowed_m = config_.limits.following_error_m;
  const double inside_m = std::clamp(known_m_[axis], device.travel_min_m, device.travel_max_m);
  const double beyond_m = std::abs(known_m_[axis] - inside_m);
  const double begun_beyond_m = std::abs(
      begun_m_[axis] - std::clamp(begun_m_[axis], device.travel_min_m, device.travel_max_m));
  return std::abs(setpoints_m_[axis] - inside_m) > allowed_m ||
         beyond_m > begun_beyond_m + allowed_m;
}

void RigMachine::watchAxes() {
  const bool follows = activity_ == Activity::kJog || activity_ == Activity::kRun ||
                       activity_ == Activity::kUnload || activity_ == Activity::kMap;
  for (std::size_t i = 0; i < config_.axes.size(); ++i) {
    const AxisInput& axis = axes_[i];
    const std::string& name = config_.axes[i].device.name;
    const bool lost = !axis.position_m || !axis.energised || !axis.fault.empty();
    if (lost && activity_ == Activity::kUnload) continue;  // the others still unload
    if (lost) return trip(name, axis.fault.empty() ? "no-current" : axis.fault, "");
    if (follows && strays(i)) {
      return trip(name, "following-error",
                  "is at " + std::to_string(*axis.position_m) + " m instead of " +
                      std::to_string(setpoints_m_[i]) + " m");
    }
  }
}

void RigMachine::trip(const std::string& source, const std::string& fault,
                      const std::string& text) {
  orders_->halt = true;
  orders_->release_halt = false;
  orders_->records.emplace_back(FaultEvent{source, fault, text});
  if (state_ == RigState::kFault) {
    if (activity_ == Activity::kUnload) unloadingEnded(source + ": " + fault);
    if (activity_ != Activity::kSettle) activity_ = Activity::kNone;  // what settles still unloads
    return;
  }
  const bool was_moving = activity_ != Activity::kNone && activity_ != Activity::kTare;
  const bool was_unloading = activity_ == Activity::kUnload;
  endRun(fault);
  loading_ = false;
  changeState(RigState::kFault, source + ": " + fault);
  activity_ = Activity::kNone;
  if (was_unloading) unloadingEnded(source + ": " + fault);
  if (was_moving && !was_unloading) begin(Activity::kSettle);
}

void RigMachine::stop(const std::string& why, bool halt_needed) {
  orders_->halt = orders_->halt || halt_needed;
  orders_->release_halt = false;
  if (activity_ == Activity::kUnload) unloadingEnded(why);
  endRun(why);
  loading_ = false;
  activity_ = Activity::kNone;
  if (state_ != RigState::kOff) changeState(RigState::kStopped, why);
}

void RigMachine::changeState(RigState to, const std::string& reason) {
  if (to == state_ && reason == reason_) return;
  orders_->records.emplace_back(
      StateChange{std::string(rigStateName(state_)), std::string(rigStateName(to)), reason});
  state_ = to;
  reason_ = reason;
}

std::string RigMachine::doubt() const {
  for (std::size_t i = 0; i < config_.axes.size(); ++i) {
    const std::string& name = config_.axes[i].device.name;
    if (!axes_[i].fault.empty()) return name + ": " + axes_[i].fault;
    if (!axes_[i].position_certain) return name + ": not homed";
  }
  for (std::size_t i = 0; i < config_.cells.size(); ++i) {
    const CellInput& cell = tick_->cells[i];
    if (!cell.gross_N || cell.age_ns > kStale_ns) {
      return config_.cells[i].id + ": " + (cell.fault.empty() ? "stale" : cell.fault);
    }
    if (*cell.gross_N > config_.limits.working_N) return config_.cells[i].id + ": working-force";
  }
  return "";
}

void RigMachine::settleIdleState() {
  if (activity_ != Activity::kNone) return;
  loading_ = false;
  if (recording_) orders_->run_ended = true;
  recording_ = false;
  if (state_ == RigState::kOff || state_ == RigState::kFault || state_ == RigState::kStopped)
    return;
  const bool off = std::any_of(axes_.begin(), axes_.end(),
                               [](const AxisInput& axis) { return !axis.energised; });
  if (off) {
    enabled_ = false;
    return changeState(RigState::kOff, "an axis has no current");
  }
  const std::string why = doubt();
  changeState(why.empty() ? RigState::kReady : RigState::kCaution, why);
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

void RigMachine::carryOut(const RigCommand& command) {
  const auto axis = static_cast<std::size_t>(command.axis);
  switch (command.kind) {
    case Kind::kEnable:
      enabled_ = true;
      orders_->energise = orders_->release_halt = true;
      return;
    case Kind::kDisable:
      enabled_ = false;
      orders_->deenergise = true;
      return changeState(RigState::kOff, "disabled");
    case Kind::kHome:
      orders_->home = orders_->release_halt = true;
      changeState(RigState::kRunning, "homing");
      return begin(Activity::kHome);
    case Kind::kTare:
      tare_sums_N_.assign(config_.cells.size(), 0.0);
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
