// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tenter/rig/rig_machine.h"

namespace tenter::rig_test {

inline constexpr double kTick_s = 0.02;
inline constexpr double kSample_N_per_m = 200.0;
inline constexpr double kMaxSpeed_m_per_s = 0.005;

inline std::string benchToml() {
  std::string toml = R"(schema_version = 1
name = "bench"
[limits]
absolute_N = 6.0
working_N = 5.0
slack_N = 0.05
slope_N_per_s = 30.0
stiffest_sample_N_per_m = 400.0
following_error_m = 0.001
)";
  for (const std::string i : {"1", "2"}) {
    toml += "[[cell]]\nname = \"cell-" + i + "\"\naddress = \"tcp:127.0.0.1:15502\"\nunit = " + i +
            "\nmap = \"laumas-tlb\"\ncapacity_N = 50.0\n";
    toml += "[[axis]]\nname = \"axis-" + i + "\"\nserial = \"0000000" + i +
            "\"\nmetres_per_unit = 1e-6\ntravel_m = [0.0, 0.08]\nmax_speed_m_per_s = 0.005\n" +
            "max_acceleration_m_per_s2 = 0.1\ncell = \"cell-" + i + "\"\n";
  }
  return toml;
}

inline std::string benchProtocolToml() {
  return R"(schema_version = 1
name = "pull"
description = "two cords, two cycles"
axes = ["axis-1", "axis-2"]
speed_m_per_s = 0.004
capture_interval_s = 0.5
[[phase]]
name = "cycle"
cycles = 2
[[phase.step]]
end = "force"
force_N = 3.0
limit_m = 0.05
[[phase.step]]
end = "hold"
hold_s = 0.2
[[phase.step]]
end = "force"
force_N = 0.5
limit_m = 0.05
)";
}

/// Two axes that pull one spring from its two ends, the machine that drives them, and everything
/// that the machine ever ordered.
class MachineBench {
 public:
  MachineBench() : MachineBench(*parseRigConfig(benchToml(), "rig.toml")) {}
  explicit MachineBench(const RigConfig& config) : machine(config) {
    tick.axes.resize(config.axes.size());
    tick.cells.resize(config.cells.size());
    position_m.assign(config.axes.size(), 0.01);
    goal_m = position_m;
    for (AxisInput& axis : tick.axes) axis.position_certain = true;
  }

  /// Forces as the spring gives them; `extra_N` on the first cell.
  double force_N(std::size_t cell) const {
    const double added_N = cell == 0 ? extra_N : 0.0;
    if (own_springs) {
      const std::size_t axis = crossed ? position_m.size() - 1 - cell : cell;
      const double drawn_m = position_m[axis] - 0.01 - slack_m;
      return std::max(0.0, kSample_N_per_m * drawn_m) + added_N;
    }
    double stretch_m = -0.022;
    for (const double p : position_m) stretch_m += p;
    return std::max(0.0, kSample_N_per_m * stretch_m) + added_N;
  }

  const RigOrders& step() {
    tick.time_ns += static_cast<std::int64_t>(1e9 * kTick_s);
    for (std::size_t i = 0; i < position_m.size(); ++i) {
      if (stuck != static_cast<int>(i)) {
        const double most_m = 1.5 * kMaxSpeed_m_per_s * kTick_s;
        position_m[i] += std::clamp(goal_m[i] - position_m[i], -most_m, most_m);
      }
      const bool mute = mute_axis == static_cast<int>(i);
      tick.axes[i].position_m = mute ? std::nullopt : std::optional(position_m[i]);
      if (mute_axis >= 0) tick.axes[i].fault = mute ? "timeout" : "";
    }
    for (std::size_t i = 0; i < tick.cells.size(); ++i) {
      const bool stale = stale_cell == static_cast<int>(i);
      tick.cells[i].gross_N = stale ? std::nullopt : std::optional(force_N(i));
      tick.cells[i].fault = stale ? "silence" : "";
    }
    orders = machine.step(tick);
    tick.commands.clear();
    tick.trip.reset();
    tick.halted_outside = false;
    if (orders.halt) goal_m = position_m;
    if (orders.energise || orders.deenergise) {
      for (AxisInput& axis : tick.axes) axis.energised = orders.energise;
    }
    for (std::size_t i = 0; i < goal_m.size(); ++i) {
      if (orders.targets_m[i]) goal_m[i] = *orders.targets_m[i];
    }
    records.insert(records.end(), orders.records.begin(), orders.records.end());
    return orders;
  }

  /// Gives a command in the next tick; what it was refused for, or "".
  std::string command(RigCommand command) {
    command.id = ++last_id_;
    tick.commands.push_back(std::move(command));
    step();
    return orders.answers.at(0).refusal;
  }
  std::string command(RigCommand::Kind kind) {
    RigCommand plain;
    plain.kind = kind;
    return command(plain);
  }
  std::string jog(int axis, double distance_m) {
    RigCommand jog;
    jog.kind = RigCommand::Kind::kJog;
    jog.axis = axis;
    jog.distance_m = distance_m;
    jog.speed_m_per_s = 0.002;
    return command(jog);
  }
  std::string run(const std::string& toml = benchProtocolToml()) {
    RigCommand run;
    run.kind = RigCommand::Kind::kRun;
    run.protocol = std::make_shared<CaptureProtocol>(*parseCaptureProtocol(toml, "p.toml"));
    return command(run);
  }
  void enable() {
    command(RigCommand::Kind::kEnable);
    steps(2);
  }
  /// Enabled, and a run has this much force.
  bool pulls(double force) {
    enable();
    run();
    return loadUpTo(force);
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) step();
  }
  /// Steps until the state is reached; false after 60 s of its time.
  bool reach(RigState state) {
    for (int i = 0; i < 3000; ++i) {
      if (machine.state() == state) return true;
      step();
    }
    return false;
  }
  /// Steps until the loading phase has this much force.
  bool loadUpTo(double force) {
    for (int i = 0; i < 3000 && force_N(1) < force; ++i) step();
    return force_N(1) >= force;
  }
  int countOf(const std::string& decision) const {
    return static_cast<int>(std::count_if(records.begin(), records.end(), [&](const auto& record) {
      const auto* d = std::get_if<Decision>(&record);
      return d != nullptr && d->name == decision;
    }));
  }
  bool hasFault(const std::string& fault) const {
    return std::any_of(records.begin(), records.end(), [&](const auto& record) {
      const auto* f = std::get_if<FaultEvent>(&record);
      return f != nullptr && f->fault == fault;
    });
  }

  RigMachine machine;
  RigTick tick;
  RigOrders orders;
  std::vector<RecordBody> records;
  std::vector<double> position_m, goal_m;
  double extra_N = 0.0;
  bool own_springs = false;  ///< Each cord on a spring of its own,
  bool crossed = false;      ///< felt by another cord's cell,
  double slack_m = 0.001;    ///< once it is drawn in so far.
  int stuck = -1, stale_cell = -1, mute_axis = -1;

 private:
  std::uint64_t last_id_ = 0;
};

}  // namespace tenter::rig_test
