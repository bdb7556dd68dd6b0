// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/fault_schedule.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "random_numbers.h"

namespace tenter {

RigPhase RigPhaseWatch::see(double time_s, const RigSnapshot& now) {
  const bool first = axes_.empty();
  axes_.resize(now.positions_m.size());
  int moving = 0;
  double direction = 0.0;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    Moved& axis = axes_[i];
    const double way_m = first ? 0.0 : now.positions_m[i] - axis.last_m;
    axis.last_m = now.positions_m[i];
    if (way_m != 0.0) {
      axis.at_s = time_s;
      axis.direction = std::copysign(1.0, way_m);
    }
    if (time_s - axis.at_s > kMemory_s) continue;
    ++moving;
    direction += axis.direction;
  }
  if (std::any_of(now.homing.begin(), now.homing.end(), [](bool homing) { return homing; })) {
    return RigPhase::kHoming;
  }
  if (moving == 1) return RigPhase::kJog;
  if (moving > 1) return direction >= 0.0 ? RigPhase::kLoading : RigPhase::kUnloading;
  const bool pulls = std::any_of(now.tensions_N.begin(), now.tensions_N.end(),
                                 [](double tension_N) { return tension_N > kPulls_N; });
  return pulls ? RigPhase::kHolding : RigPhase::kIdle;
}

struct FaultSchedule::State {
  explicit State(const FaultScript& script)
      : random(script.seed, "fault script"), runs(script.faults.size()) {}

  /// Where one fault of the script stands.
  struct Run {
    std::optional<double> begins_s, ends_s;  // triggered; begun
    bool was_so = false;                     // its trigger, a step ago
    int happened = 0, ended = 0;
    int seen_ended = 0;  // of the fault that it waits for
  };

  RandomNumbers random;
  RigPhaseWatch watch;
  RigPhase phase = RigPhase::kIdle;
  std::vector<Run> runs;
  std::map<std::string, std::size_t> names;
};

FaultSchedule::FaultSchedule(FaultScript script)
    : script_(std::move(script)), state_(std::make_unique<State>(script_)) {
  for (std::size_t i = 0; i < script_.faults.size(); ++i) {
    state_->names[script_.faults[i].name] = i;
  }
}

FaultSchedule::~FaultSchedule() = default;

/// Whether the condition holds; a fault begins where it comes to hold.
bool FaultSchedule::triggered(std::size_t index, const RigSnapshot& now, double time_s) const {
  const FaultTrigger& trigger = script_.faults[index].trigger;
  const auto device = static_cast<std::size_t>(script_.faults[index].device);
  if (trigger.at_s) return time_s >= *trigger.at_s;
  if (trigger.phase) return state_->phase == *trigger.phase;
  if (trigger.force_N) return now.tensions_N[device] >= *trigger.force_N;
  if (trigger.position_m) return now.positions_m[device] >= *trigger.position_m;
  const std::size_t before = state_->names.at(trigger.after);
  return state_->runs[before].ended > state_->runs[index].seen_ended;
}

std::vector<FaultAction> FaultSchedule::step(double time_s, const RigSnapshot& now) {
  std::vector<FaultAction> actions;
  state_->phase = state_->watch.see(time_s, now);
  for (std::size_t i = 0; i < script_.faults.size(); ++i) {
    const ScriptedFault& fault = script_.faults[i];
    State::Run& run = state_->runs[i];
    if (run.ends_s && time_s >= *run.ends_s) {
      run.ends_s.reset();
      ++run.ended;
      if (fault.for_s) actions.push_back({i, false});
    }
    const bool is_so = triggered(i, now, time_s);
    const bool rises = is_so && !run.was_so;
    const bool may = fault.trigger.times == 0 || run.happened < fault.trigger.times;
    run.was_so = is_so;
    if (rises && may && !run.begins_s && !run.ends_s) {
      if (!fault.trigger.after.empty()) {
        run.seen_ended = state_->runs[state_->names.at(fault.trigger.after)].ended;
        run.was_so = false;
      }
      const double share = state_->random.uniform();
      run.begins_s = time_s + fault.trigger.delay_min_s +
                     share * (fault.trigger.delay_max_s - fault.trigger.delay_min_s);
    }
    if (run.begins_s && time_s >= *run.begins_s) {
      run.begins_s.reset();
      ++run.happened;
      // One that is counted has ended, for those that wait for it, as soon as it has begun.
      run.ends_s = time_s + fault.for_s.value_or(0.0);
      actions.push_back({i, true});
    }
  }
  return actions;
}

}  // namespace tenter
