// SPDX-License-Identifier: GPL-3.0-or-later
// What the machine does: jog, homing, tare, unloading, protocols.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "tenter/rig/rig_machine.h"

namespace tenter {
namespace {

constexpr double kSettle_s = 0.1;  // a halted axis stands, and its cells have read that
constexpr double kHomeFirst_s = 0.3;
constexpr double kHomeLimit_s = 120.0, kUnloadLimit_s = 120.0;
constexpr double kSlackShare = 0.8;  // of slack_N, so that noise does not make it a load again
constexpr int kTareTicks = 25;
constexpr double kUnsteadyShare = 1.0;  // of slack_N: what swings more has no zero
constexpr double kArrived_m = 1e-9;
constexpr double kFar_m = 1e3;
/// What an axis may go beyond where it should be, if it is not told anything more.
constexpr double kLongestLead_m = 1e-4;
/// An axis so many ticks behind goes faster by so much until it has caught up.
constexpr double kBehindTicks = 3.0, kCatchUp = 1.25;
/// Bound on what may follow in one tick without moving: a file of steps that are all done already.
constexpr int kStepsPerTick = 8;

}  // namespace

double RigMachine::seconds() const {
  return 1e-9 * static_cast<double>(tick_->time_ns - since_ns_);
}

void RigMachine::begin(Activity activity) {
  activity_ = activity;
  since_ns_ = tick_->time_ns;
  begun_m_ = known_m_;
  for (std::size_t i = 0; i < known_m_.size(); ++i) {
    const AxisConfig& axis = config_.axes[i].device;
    setpoints_m_[i] = std::clamp(known_m_[i], axis.travel_min_m, axis.travel_max_m);
  }
  const bool on_its_own = activity == Activity::kJog || activity == Activity::kMap;
  if (!protocol_ && on_its_own) keepOrigins();
  history_N_.clear();
  history_ns_.clear();
}

/// Where a cord is slack: it may be let out to there should its cell fall silent.
void RigMachine::keepOrigins() {
  for (std::size_t i = 0; i < known_m_.size(); ++i) {
    const std::optional<int> cell = config_.axes[i].cell;
    const auto tension_N = cell ? net_N(static_cast<std::size_t>(*cell)) : std::optional(0.0);
    const bool slack = tension_N && *tension_N <= config_.limits.slack_N;
    if (slack) origins_m_[i] = known_m_[i];
  }
}

void RigMachine::decide(const std::string& name, std::string data) {
  orders_->records.emplace_back(Decision{name, std::move(data)});
}

std::optional<double> RigMachine::net_N(std::size_t cell) const {
  const CellInput& input = tick_->cells[cell];
  if (!input.gross_N || input.age_ns > kStale_ns) return std::nullopt;
  return *input.gross_N - tares_N_[cell];
}

double RigMachine::highestForce_N() const {
  double highest = 0.0;
  for (const CellInput& cell : tick_->cells)
    highest = std::max(highest, std::abs(cell.gross_N.value_or(0.0)));
  return highest;
}

/// Loading axes add up on one sample, so their sum keeps to the cap, catching up included.
void RigMachine::move(const std::vector<double>& velocities_m_per_s) {
  double loading_m_per_s = 0.0;
  for (const double v : velocities_m_per_s) loading_m_per_s += std::max(v, 0.0);
  const double scale = loading_m_per_s > cap_m_per_s_ ? cap_m_per_s_ / loading_m_per_s : 1.0;
  double told_m_per_s = 0.0;
  for (std::size_t i = 0; i < velocities_m_per_s.size(); ++i) {
    const double v = velocities_m_per_s[i] * (velocities_m_per_s[i] > 0.0 ? scale : 1.0);
    if (v == 0.0) continue;
    const AxisConfig& axis = config_.axes[i].device;
    const double behind_m = std::abs(setpoints_m_[i] - known_m_[i]);
    const double most_m =
        v > 0.0 ? std::min(axis.travel_max_m, goals_m_[i].value_or(kFar_m)) : axis.travel_max_m;
    const double least_m =
        v < 0.0 ? std::max(axis.travel_min_m, goals_m_[i].value_or(-kFar_m)) : axis.travel_min_m;
    setpoints_m_[i] = std::clamp(setpoints_m_[i] + v * dt_s_, axis.travel_min_m, axis.travel_max_m);
    const double lead_m = std::min(std::abs(v) * dt_s_, kLongestLead_m);
    orders_->targets_m[i] =
        std::clamp(setpoints_m_[i] + std::copysign(lead_m, v), std::min(least_m, setpoints_m_[i]),
                   std::max(most_m, setpoints_m_[i]));
    const bool late = behind_m > kBehindTicks * std::abs(v) * dt_s_;
    orders_->speeds_m_per_s[i] =
        std::min(axis.max_speed_m_per_s, std::abs(v) * (late ? kCatchUp : 1.0));
    if (v > 0.0) told_m_per_s += orders_->speeds_m_per_s[i];
  }
  if (told_m_per_s <= cap_m_per_s_) return;
  for (std::size_t i = 0; i < velocities_m_per_s.size(); ++i)
    if (velocities_m_per_s[i] > 0.0) orders_->speeds_m_per_s[i] *= cap_m_per_s_ / told_m_per_s;
}

void RigMachine::act() {
  if (state_ == RigState::kPaused || (loading_ && blind_)) return;
  switch (activity_) {
    case Activity::kNone:
      return;
    case Activity::kSettle:
      if (seconds() >= kSettle_s) startUnloading();
      return;
    case Activity::kJog:
      return actJog();
    case Activity::kHome:
      return actHome();
    case Activity::kTare:
      return actTare();
    case Activity::kUnload:
      return actUnload();
    case Activity::kRun:
      return actRun();
    case Activity::kMap:
      return actMap();
  }
}

void RigMachine::actJog() {
  const auto axis = static_cast<std::size_t>(jog_axis_);
  const double left_m = jog_target_m_ - setpoints_m_[axis];
  if (std::abs(left_m) <= kArrived_m) {
    activity_ = Activity::kNone;
    return conclude("done", "");
  }
  const double step_m = std::min(jog_speed_m_per_s_ * dt_s_, std::abs(left_m));
  goals_m_[axis] = jog_target_m_;
  std::vector<double> velocities(config_.axes.size(), 0.0);
  if (dt_s_ > 0.0) velocities[axis] = std::copysign(step_m / dt_s_, left_m);
  move(velocities);
}

/// A switch that stays pressed would let its axis draw in without end, looking for where it is let
/// go. A count that jumps to its zero at the end is no way.
bool RigMachine::homesAstray(std::size_t axis) {
  const AxisInput& input = axes_[axis];
  if (!input.homing || !input.position_m) return false;
  begun_m_[axis] = std::min(begun_m_[axis], *input.position_m);
  return *input.position_m - begun_m_[axis] > config_.limits.following_error_m;
}

void RigMachine::actHome() {
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (!homesAstray(i)) continue;
    return trip(config_.axes[i].device.name, "homing-astray", "does not leave its limit switch");
  }
  if (seconds() < kHomeFirst_s) return;
  const bool done = std::all_of(axes_.begin(), axes_.end(), [](const AxisInput& axis) {
    return !axis.homing && axis.position_certain;
  });
  if (done) {
    decide("homed");
    conclude("done", "");
    activity_ = Activity::kNone;
  } else if (seconds() > kHomeLimit_s) {
    trip("rig", "homing-timeout", "not every axis found its end");
  }
}

/// Only what is slack and steady has a zero, no further from the amplifier's own than what counts
/// as slack: a load that became the zero would be invisible to unloading.
void RigMachine::actTare() {
  const auto refuse = [&](std::size_t cell, const std::string& why) {
    activity_ = Activity::kNone;
    const std::string& name = config_.cells[cell].id;
    decide("tare-refused", nlohmann::json{{"cell", name}, {"why", why}}.dump());
    conclude("refused", name + " " + why);
  };
  for (std::size_t i = 0; i < config_.cells.size(); ++i) {
    const auto& gross_N = tick_->cells[i].gross_N;
    if (!gross_N) return refuse(i, "gives no tension");
    tare_sums_N_[i] += *gross_N;
    tare_lowest_N_[i] = std::min(tare_lowest_N_[i], *gross_N);
    tare_highest_N_[i] = std::max(tare_highest_N_[i], *gross_N);
  }
  if (++tare_ticks_ < kTareTicks) return;
  std::vector<double> tares_N;
  for (std::size_t i = 0; i < config_.cells.size(); ++i) {
    tares_N.push_back(tare_sums_N_[i] / kTareTicks);
    if (tare_highest_N_[i] - tare_lowest_N_[i] > kUnsteadyShare * config_.limits.slack_N)
      return refuse(i, "is not steady");
    if (std::abs(tares_N[i]) > config_.limits.slack_N) {
      char text[96];
      std::snprintf(text, sizeof text,
                    "is under load (%.3f N against its zero): unload it, or calibrate the cell",
                    tares_N[i]);
      return refuse(i, text);
    }
  }
  activity_ = Activity::kNone;
  tares_N_ = tares_N;
  decide("tare", nlohmann::json{{"tares_N", tares_N_}}.dump());
  conclude("done", "");
}

void RigMachine::startUnloading() {
  begin(Activity::kUnload);
  frozen_.assign(frozen_.size(), false);
  loading_ = false;
  orders_->release_halt = !orders_->halt;
  unload_ceiling_N_ =
      highestForce_N() + 0.5 * (config_.limits.absolute_N - config_.limits.working_N);
}

/// Every cord is let out until its own cell is slack; where that does not say, to where the motion
/// began.
void RigMachine::actUnload() {
  std::vector<double> velocities(config_.axes.size(), 0.0);
  std::string left;
  bool going = false;
  for (std::size_t i = 0; i < config_.axes.size(); ++i) {
    const RigAxis& axis = config_.axes[i];
    if (!axis.cell) continue;
    const auto tension_N = net_N(static_cast<std::size_t>(*axis.cell));
    const bool slack = tension_N ? *tension_N <= kSlackShare * config_.limits.slack_N
                                 : setpoints_m_[i] <= origins_m_[i];
    const auto leave = [&](const std::string& why) { left += (left.empty() ? "" : ", ") + why; };
    if (slack) {
      // At where its cord was slack last; whether it is now nobody knows.
      if (!tension_N)
        leave(config_.cells[static_cast<std::size_t>(*axis.cell)].id + " gives no tension");
      continue;
    }
    const AxisInput& input = axes_[i];
    if (frozen_[i]) {
      leave(axis.device.name + " does not follow");
    } else if (!input.energised || !input.fault.empty() || !input.position_m) {
      leave(axis.device.name + " does not move");
    } else if (setpoints_m_[i] <= axis.device.travel_min_m) {
      // it may still be on its way to where it was sent last
      if (known_m_[i] > axis.device.travel_min_m + config_.limits.following_error_m) going = true;
      leave(axis.device.name + " is at the end of its travel");
    } else {
      going = true;
      velocities[i] = -axis.device.max_speed_m_per_s;
    }
  }
  if (highestForce_N() > unload_ceiling_N_) {
    return trip("rig", "force-rises", "a tension rises while the cords are let out");
  }
  if (going && seconds() <= kUnloadLimit_s) return move(velocities);
  if (going) left = "it took too long";
  activity_ = Activity::kNone;
  unloadingEnded(left);
}

void RigMachine::unloadingEnded(const std::string& left) {
  conclude(left.empty() ? "done" : "not-unloaded", left);
  if (left.empty()) return decide("unloaded");
  decide("not-unloaded", nlohmann::json{{"why", left}}.dump());
  changeState(RigState::kFault, "not unloaded: " + left);
}

std::optional<double> RigMachine::meanTension_N(const ProtocolStep& step) const {
  double sum = 0.0;
  for (const std::string& name : step.axes) {
    const RigAxis& axis = config_.axes[static_cast<std::size_t>(*config_.findAxis(name))];
    const auto tension_N = net_N(static_cast<std::size_t>(*axis.cell));
    if (!tension_N) return std::nullopt;
    sum += *tension_N;
  }
  return sum / static_cast<double>(step.axes.size());
}

void RigMachine::enterStep() {
  const ProtocolPhase& phase = protocol_->phases[phase_];
  const ProtocolStep& step = phase.steps[step_];
  if (step_ == 0) {
    orders_->records.emplace_back(
        PhaseRecord{static_cast<std::int64_t>(phase_), cycle_, phase.name, true});
  }
  step_since_ns_ = tick_->time_ns;
  if (step.end == StepEnd::kForce) {
    const auto mean_N = meanTension_N(step);
    direction_ = mean_N && *mean_N > step.force_N ? -1.0 : 1.0;
  }
  decide("step", nlohmann::json{{"phase", phase_}, {"cycle", cycle_}, {"step", step_}}.dump());
}

void RigMachine::leaveStep() {
  const ProtocolPhase& phase = protocol_->phases[phase_];
  if (++step_ == phase.steps.size()) {
    orders_->records.emplace_back(
        PhaseRecord{static_cast<std::int64_t>(phase_), cycle_, phase.name, false});
    step_ = 0;
    if (++cycle_ == phase.cycles) {
      cycle_ = 0;
      ++phase_;
    }
  }
  if (phase_ < protocol_->phases.size()) return enterStep();
  endRun("done");
  changeState(RigState::kRunning, "unloading");
  startUnloading();
}

void RigMachine::startProtocol() {
  phase_ = step_ = 0;
  cycle_ = 0;
  captures_ = 0;
  next_capture_ns_ = tick_->time_ns;
  changeState(RigState::kRunning, "protocol " + protocol_->name);
  begin(Activity::kRun);
  origins_m_ = known_m_;
  loading_ = true;
  decide("run",
         nlohmann::json{
             {"protocol", protocol_->name}, {"tares_N", tares_N_}, {"origins_m", origins_m_}}
             .dump());
  enterStep();
}

void RigMachine::endRun(const std::string& how) {
  if (!protocol_) return;
  decide("run-ended", nlohmann::json{{"how", how}, {"captures", captures_}}.dump());
  protocol_.reset();
  loading_ = false;
}

bool RigMachine::stepDone(const ProtocolStep& step) {
  switch (step.end) {
    case StepEnd::kHold:
      return 1e-9 * static_cast<double>(tick_->time_ns - step_since_ns_) >= step.hold_s;
    case StepEnd::kForce: {
      const auto mean_N = meanTension_N(step);
      return mean_N && direction_ * (*mean_N - step.force_N) >= 0.0;
    }
    case StepEnd::kTravel:
      break;
  }
  for (std::size_t k = 0; k < step.axes.size(); ++k) {
    const auto i = static_cast<std::size_t>(*config_.findAxis(step.axes[k]));
    const double target_m = origins_m_[i] + step.targets_m[k];
    if (std::abs(setpoints_m_[i] - target_m) > kArrived_m) return false;
  }
  return true;
}

void RigMachine::driveStep(const ProtocolStep& step) {
  std::vector<double> velocities(config_.axes.size(), 0.0);
  for (std::size_t k = 0; k < step.axes.size(); ++k) {
    const auto i = static_cast<std::size_t>(*config_.findAxis(step.axes[k]));
    if (step.end == StepEnd::kTravel) {
      const double left_m = origins_m_[i] + step.targets_m[k] - setpoints_m_[i];
      goals_m_[i] = origins_m_[i] + step.targets_m[k];
      const double step_m = std::min(step.speed_m_per_s * dt_s_, std::abs(left_m));
      if (dt_s_ > 0.0) velocities[i] = std::copysign(step_m / dt_s_, left_m);
    } else if (std::abs(setpoints_m_[i] - origins_m_[i]) > step.limit_m) {
      return trip(step.axes[k], "force-not-reached", "the step's limit_m is used up");
    } else {
      velocities[i] = direction_ * step.speed_m_per_s;
    }
  }
  const std::vector<double> before_m = setpoints_m_;
  move(velocities);
  for (std::size_t i = 0; i < velocities.size(); ++i) {
    if (dt_s_ > 0.0 && std::abs(velocities[i]) * dt_s_ > kArrived_m &&
        setpoints_m_[i] == before_m[i]) {
      return trip(config_.axes[i].device.name, "travel", "the axis is at the end of its travel");
    }
  }
}

void RigMachine::actRun() {
  const auto kept = protocol_;  // a trip lets go of it while its steps are in use
  if (tick_->time_ns >= next_capture_ns_) {
    decide("capture", nlohmann::json{{"index", captures_++}}.dump());
    next_capture_ns_ += static_cast<std::int64_t>(1e9 * protocol_->capture_interval_s);
  }
  for (int i = 0; i < kStepsPerTick && activity_ == Activity::kRun; ++i) {
    const ProtocolStep& step = protocol_->phases[phase_].steps[step_];
    if (!stepDone(step)) {
      if (step.end != StepEnd::kHold) driveStep(step);
      return;
    }
    leaveStep();
  }
}

}  // namespace tenter
