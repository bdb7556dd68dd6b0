// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/protocol_simulation.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "tenter/rig/rig_machine.h"

namespace tenter {
namespace {

constexpr std::int64_t kTick_ns = 20'000'000;
constexpr std::int64_t kLongest_ns = 4 * 3600 * 1'000'000'000LL;
constexpr int kHalvings = 10;
constexpr int kTicksToEnable = 10;

/// Ideal axes and cells around the machine.
class Bench {
 public:
  Bench(const RigConfig& rig, double stiffness_N_per_m)
      : rig_(rig), stiffness_N_per_m_(stiffness_N_per_m), machine_(rig) {
    for (const RigAxis& axis : rig.axes) begun_m_.push_back(axis.device.travel_min_m);
    position_m_ = goal_m_ = begun_m_;
    speed_m_per_s_.resize(rig.axes.size());
    tick_.axes.resize(rig.axes.size());
    tick_.cells.resize(rig.cells.size());
    for (AxisInput& axis : tick_.axes) axis.position_certain = true;
  }

  const RigMachine& machine() const { return machine_; }
  double seconds() const { return 1e-9 * static_cast<double>(tick_.time_ns); }

  RigOrders give(RigCommand command) {
    tick_.commands.push_back(std::move(command));
    return step();
  }

  RigOrders step() {
    tick_.time_ns += kTick_ns;
    move();
    RigOrders orders = machine_.step(tick_);
    tick_.commands.clear();
    if (orders.energise || orders.deenergise)
      for (AxisInput& axis : tick_.axes) axis.energised = orders.energise;
    if (orders.halt) goal_m_ = position_m_;
    for (std::size_t i = 0; i < goal_m_.size(); ++i) {
      if (!orders.targets_m[i]) continue;
      goal_m_[i] = *orders.targets_m[i];
      speed_m_per_s_[i] = orders.speeds_m_per_s[i];
    }
    return orders;
  }

  double highestForce_N() const {
    double highest = 0.0;
    for (const CellInput& cell : tick_.cells) highest = std::max(highest, *cell.gross_N);
    return highest;
  }

  double longestWay_m() const {
    double longest = 0.0;
    for (std::size_t i = 0; i < position_m_.size(); ++i)
      longest = std::max(longest, std::abs(position_m_[i] - begun_m_[i]));
    return longest;
  }

 private:
  void move() {
    for (CellInput& cell : tick_.cells) cell.gross_N = 0.0;
    for (std::size_t i = 0; i < position_m_.size(); ++i) {
      const double most_m = 1e-9 * static_cast<double>(kTick_ns) * speed_m_per_s_[i];
      position_m_[i] += std::clamp(goal_m_[i] - position_m_[i], -most_m, most_m);
      tick_.axes[i].position_m = position_m_[i];
      if (rig_.axes[i].cell) {
        tick_.cells[static_cast<std::size_t>(*rig_.axes[i].cell)].gross_N =
            stiffness_N_per_m_ * std::max(0.0, position_m_[i] - begun_m_[i]);
      }
    }
  }

  const RigConfig& rig_;
  double stiffness_N_per_m_;
  RigMachine machine_;
  RigTick tick_;
  std::vector<double> begun_m_, position_m_, goal_m_, speed_m_per_s_;
};

RigCommand commandOf(RigCommand::Kind kind) {
  RigCommand command;
  command.kind = kind;
  return command;
}

/// Where the protocol is, from the machine's decision.
std::string placeOf(const CaptureProtocol& protocol, const std::string& data) {
  const auto at = nlohmann::json::parse(data);
  return "phase " + protocol.phases.at(at.at("phase").get<std::size_t>()).name + ", step " +
         std::to_string(at.at("step").get<int>());
}

}  // namespace

ProtocolRun simulateProtocol(const CaptureProtocol& protocol, const RigConfig& rig,
                             double stiffness_N_per_m) {
  Bench bench(rig, stiffness_N_per_m);
  ProtocolRun out;
  out.stiffness_N_per_m = stiffness_N_per_m;
  bench.give(commandOf(RigCommand::Kind::kEnable));
  for (int i = 0; i < kTicksToEnable; ++i) bench.step();
  RigCommand run = commandOf(RigCommand::Kind::kRun);
  run.protocol = std::make_shared<CaptureProtocol>(protocol);
  run.mapping = RigCommand::Mapping::kSkip;
  const double begun_s = bench.seconds();
  std::string place;
  const auto take = [&](const RigOrders& orders) {
    for (const RecordBody& record : orders.records) {
      if (const auto* decision = std::get_if<Decision>(&record)) {
        out.captures += decision->name == "capture";
        if (decision->name == "step") place = placeOf(protocol, decision->data);
      } else if (const auto* fault = std::get_if<FaultEvent>(&record); fault && out.fault.empty()) {
        out.fault = place + ": " + fault->source + ": " + fault->fault +
                    (fault->text.empty() ? "" : " (" + fault->text + ")");
      }
    }
  };
  const RigOrders started = bench.give(run);
  out.fault = started.answers.front().refusal;
  take(started);
  while (out.fault.empty() && bench.machine().busy()) {
    take(bench.step());
    out.highest_force_N = std::max(out.highest_force_N, bench.highestForce_N());
    out.longest_way_m = std::max(out.longest_way_m, bench.longestWay_m());
    out.duration_s = bench.seconds() - begun_s;
    if (out.duration_s > 1e-9 * static_cast<double>(kLongest_ns))
      out.fault = place + ": takes more than four hours";
  }
  out.completed = out.fault.empty() && bench.machine().purpose().how == "done";
  if (!out.completed && out.fault.empty()) out.fault = bench.machine().purpose().why;
  return out;
}

const ProtocolRun* ProtocolForecast::stiffest() const {
  const auto run = std::ranges::find_if(runs, &ProtocolRun::completed);
  return run == runs.end() ? nullptr : &*run;
}

const ProtocolRun* ProtocolForecast::softest() const {
  for (auto run = runs.rbegin(); run != runs.rend(); ++run)
    if (run->completed) return &*run;
  return nullptr;
}

ProtocolForecast forecastProtocol(const CaptureProtocol& protocol, const RigConfig& rig) {
  ProtocolForecast out;
  for (int k = 0; k <= kHalvings; ++k)
    out.runs.push_back(
        simulateProtocol(protocol, rig, std::ldexp(rig.limits.stiffest_sample_N_per_m, -k)));
  return out;
}

}  // namespace tenter
