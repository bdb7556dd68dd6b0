// SPDX-License-Identifier: GPL-3.0-or-later
// What must not be; rig_commands.cpp has what a person may ask for, rig_motion.cpp what is done.
#include "tenter/rig/rig_machine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace tenter {
namespace {

/// An axis that merely answers late keeps its last reading for so long: half of what its device
/// waits for orders before it halts by itself.
constexpr std::int64_t kSilence_ns = 100'000'000;
/// A question that a halt cut short is as good as one that was answered late.
bool isLate(std::string_view fault) { return fault == "timeout" || fault == "preempted"; }

constexpr std::size_t kSlopeTicks = 5;  // a slope over one tick would be the cell's noise
constexpr std::array<std::string_view, 7> kStateNames{"off",    "ready", "caution", "running",
                                                      "paused", "fault", "stopped"};

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
  frozen_.resize(config_.axes.size());
}

RigMachine::RigMachine(RigConfig config, const RigMemory& memory) : RigMachine(std::move(config)) {
  require(memory.axes.size() == axes_.size() && memory.heard_ns.size() == axes_.size() &&
              memory.known_m.size() == axes_.size() && memory.felt_ns.size() == felt_ns_.size() &&
              memory.tares_N.size() == tares_N_.size() && memory.mapped.size() == mapped_.size() &&
              memory.origins_m.size() == origins_m_.size(),
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
  origins_m_ = memory.origins_m;
}

RigMemory RigMachine::memory() const {
  return {state_,    reason_,  enabled_, emergency_, blind_,  last_ns_,  axes_,
          heard_ns_, known_m_, felt_ns_, tares_N_,   mapped_, origins_m_};
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
  takeCurrentAway();
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

/// Until no axis has any.
void RigMachine::takeCurrentAway() {
  if (!disabling_) return;
  disabling_ =
      std::any_of(axes_.begin(), axes_.end(), [](const AxisInput& axis) { return axis.energised; });
  orders_->deenergise = orders_->deenergise || disabling_;
}

bool RigMachine::axesFit() const {
  return std::all_of(axes_.begin(), axes_.end(), [](const AxisInput& axis) {
    return axis.energised && axis.fault.empty() && axis.position_m;
  });
}

void RigMachine::watch() {
  if (tick_->emergency_stop && !emergency_) {
    const bool was_moving = inMotion();
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
  watchAxes();
  if (moving()) watchLoading();
  // What lets the cords out anyway is not to be stopped for want of somebody who looks on.
  if (recording_ && unloading() && !tick_->recorder_fault.empty()) noteUnwritten();
  if (busy() && !unloading()) {
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
    // A wrong sign is no smaller a force.
    if (gross_N && std::abs(*gross_N) > config_.limits.absolute_N) {
      return trip(config_.cells[i].id, "absolute-force", newtons(*gross_N));
    }
  }
  if (tick_->trip && !yields) {
    trip(config_.cells.at(static_cast<std::size_t>(tick_->trip->cell)).id, "absolute-force",
         newtons(tick_->trip->gross_N));
  }
}

/// What lets the cords out goes on.
void RigMachine::noteUnwritten() {
  if (state_ == RigState::kFault) return;
  orders_->records.emplace_back(FaultEvent{"session", "not-written", tick_->recorder_fault});
  conclude("tripped", "session: not-written");
  changeState(RigState::kFault, "session: not-written");
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
    if (std::abs(*cell.gross_N) > config_.limits.working_N) {
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

/// An axis that does not let its cord out, but does not draw it in either: no reason to halt the
/// others, which do.
bool RigMachine::staysBehind(std::size_t axis) const {
  return activity_ == Activity::kUnload && known_m_[axis] > setpoints_m_[axis] &&
         known_m_[axis] <= begun_m_[axis] + config_.limits.following_error_m;
}

/// Also while a run is paused: what is lost then pulls on unseen.
void RigMachine::watchAxes() {
  if (!inMotion()) return;
  const bool follows = activity_ == Activity::kJog || activity_ == Activity::kRun ||
                       activity_ == Activity::kUnload || activity_ == Activity::kMap;
  for (std::size_t i = 0; i < config_.axes.size(); ++i) {
    const AxisInput& axis = axes_[i];
    const std::string& name = config_.axes[i].device.name;
    const bool lost = !axis.position_m || !axis.energised || !axis.fault.empty();
    if (lost && activity_ == Activity::kUnload) continue;  // the others still unload
    if (lost) return trip(name, axis.fault.empty() ? "no-current" : axis.fault, "");
    if (!follows || !strays(i)) continue;
    const std::string where = "is at " + std::to_string(known_m_[i]) + " m instead of " +
                              std::to_string(setpoints_m_[i]) + " m";
    if (!staysBehind(i)) return trip(name, "following-error", where);
    if (!frozen_[i]) orders_->records.emplace_back(FaultEvent{name, "following-error", where});
    frozen_[i] = true;
  }
}

void RigMachine::trip(const std::string& source, const std::string& fault,
                      const std::string& text) {
  orders_->halt = true;
  orders_->release_halt = false;
  orders_->records.emplace_back(FaultEvent{source, fault, text});
  conclude("tripped", source + ": " + fault);
  if (state_ == RigState::kFault) {
    if (activity_ == Activity::kUnload) unloadingEnded(source + ": " + fault);
    if (activity_ != Activity::kSettle) activity_ = Activity::kNone;  // what settles still unloads
    return;
  }
  const bool was_moving = inMotion();
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
  conclude("stopped", why);
  if (activity_ == Activity::kUnload) unloadingEnded(why);
  endRun(why);
  loading_ = false;
  activity_ = Activity::kNone;
  if (state_ != RigState::kOff) changeState(RigState::kStopped, why);
}

void RigMachine::conclude(const std::string& how, const std::string& why) {
  if (purpose_.how.empty()) purpose_.how = how, purpose_.why = why;
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
    if (std::abs(*cell.gross_N) > config_.limits.working_N)
      return config_.cells[i].id + ": working-force";
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

}  // namespace tenter
