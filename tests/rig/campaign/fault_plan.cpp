// SPDX-License-Identifier: GPL-3.0-or-later
#include "fault_plan.h"

#include <algorithm>
#include <random>

#include "tenter/twin/served_rig.h"

namespace tenter::campaign {
namespace {

using enum RigPhase;
using Names = std::set<std::string>;
using Phases = std::set<RigPhase>;

const Phases kAll{kIdle, kHoming, kJog, kLoading, kHolding, kUnloading};
const Phases kMotion{kHoming, kJog, kLoading, kUnloading};

// From injection until nothing loads: the samples of two scans, a tick and the way to the last
// target; with a margin of two ticks, because the machine that runs this is shared.
constexpr int kCell_ms = 200;
// A value counts as stuck after half a second.
constexpr int kStuck_ms = 750;
// An axis that does not answer is waited for 100 ms, in ticks that its time-outs make 80 ms long;
// what it was told last ends after 200 ms by itself.
constexpr int kAxis_ms = 350;
// The device stops at once; one tick sees it.
constexpr int kSwitch_ms = 150;
// The millimetre that an axis may be behind, at the slowest speed of these trials.
constexpr int kFollowing_ms = 1600;
constexpr int kForce_ms = 100;

FaultKindRow cell(const std::string& name, Names names, bool once = false,
                  OnBus bus = OnBus::kBoth) {
  return {name, Part::kCell, bus, once, kCell_ms, std::move(names), kAll};
}

FaultKindRow axis(const std::string& name, int bound_ms, Names names, Phases phases = kAll) {
  return {name, Part::kAxis, OnBus::kBoth, false, bound_ms, std::move(names), std::move(phases)};
}

FaultKindRow program(const std::string& name, int bound_ms, Names names, Phases phases) {
  return {name, Part::kProgram, OnBus::kBoth, false, bound_ms, std::move(names), std::move(phases)};
}

std::vector<FaultKindRow> makeKinds() {
  std::vector<FaultKindRow> kinds;
  kinds.push_back(cell("silence", {"silence"}));
  for (const char* code : {"1", "2", "3", "4", "5", "6", "11"}) {
    const std::string name = std::string("exception-") + code;
    kinds.push_back(cell(name, {name}));
  }
  kinds.push_back(cell("bad-crc", {"bad-crc"}, false, OnBus::kRtu));
  kinds.push_back(cell("half-frame", {"broken-answer"}));
  kinds.push_back(cell("dribble", {"broken-answer"}));
  kinds.push_back(cell("late-answer", {"late-answer", "silence"}, true));
  kinds.push_back(cell("echo", {"echo"}, false, OnBus::kRtu));
  kinds.push_back(cell("wrong-unit", {"wrong-unit"}));
  kinds.push_back(cell("wrong-function", {"wrong-function"}));
  kinds.push_back(cell("wrong-count", {"wrong-count"}));
  kinds.push_back(cell("trailing-bytes", {"trailing-bytes", "late-answer"}));
  kinds.push_back(cell("hang-up", {"disconnected"}, false, OnBus::kTcp));
  FaultKindRow stuck = cell("stuck", {"stuck"});
  stuck.bound_ms = kStuck_ms;
  kinds.push_back(stuck);
  kinds.push_back(cell("not-a-number", {"not-a-number", "over-range"}));
  kinds.push_back(cell("over-range", {"over-range", "absolute-force"}));
  // Slack cords cannot tell it: +3 mN and -3 mN are both noise.
  FaultKindRow flip = cell("sign-flip", {"sign-flip"});
  flip.phases = {kLoading, kHolding, kUnloading};
  kinds.push_back(flip);
  kinds.push_back(
      cell("word-swap", {"word-order", "over-range", "inconsistent", "not-a-number", "sign-flip"}));
  kinds.push_back(cell("cell-error", {"cell-error"}));
  FaultKindRow force = cell("added-force", {"absolute-force", "working-force"});
  force.bound_ms = kForce_ms;
  kinds.push_back(force);

  kinds.push_back(axis("stall", kAxis_ms, {"stall"}));
  kinds.push_back(axis("protocol-error", kAxis_ms, {"protocol-error"}));
  kinds.push_back(axis("short-reply", kAxis_ms, {"short-reply"}));
  kinds.push_back(axis("mute", kAxis_ms, {"timeout"}));
  kinds.push_back(axis("unplug-in-transfer", kAxis_ms, {"unplugged", "timeout"}));
  kinds.push_back(axis("unplug", kAxis_ms, {"unplugged"}));
  kinds.push_back(axis("kill-switch", kSwitch_ms, {"kill-switch"}));
  kinds.push_back(axis("under-voltage", kSwitch_ms, {"low-supply"}));
  kinds.push_back(axis("driver-error", kSwitch_ms, {"driver-error"}));
  kinds.push_back(axis("forward-limit", kFollowing_ms, {"following-error"}, {kJog, kLoading}));
  kinds.push_back(axis("reverse-limit", 8000, {"homing-astray"}, {kHoming}));
  kinds.push_back(axis("slow", kAxis_ms, {"timeout"}));

  kinds.push_back(program("client-gone", 150, {"lease-lost"}, {kJog, kLoading, kHolding}));
  kinds.push_back(program("client-silent", 2300, {"lease-lost"}, {kJog, kLoading, kHolding}));
  kinds.push_back(program("lease-stolen", 0, {"operates the rig"}, kMotion));
  kinds.push_back(program("lease-taken-over", 2300, {"lease-lost"}, {kJog, kLoading}));
  kinds.push_back(program("daemon-killed", 250, {}, kMotion));
  kinds.push_back(program("daemon-stopped", 250, {"late-tick"}, kMotion));
  kinds.push_back(program("disk-full", 250, {"not-written"}, {kLoading, kHolding}));
  kinds.push_back(program("disk-read-only", 0, {"/proc/tenter-session"}, {kIdle}));
  return kinds;
}

}  // namespace

const std::vector<FaultKindRow>& faultKinds() {
  static const std::vector<FaultKindRow> kinds = makeKinds();
  return kinds;
}

std::vector<Injection> makePlan(std::uint64_t seed, int count, int shard, int shards, bool tcp) {
  std::vector<Injection> pairs;
  for (const FaultKindRow& kind : faultKinds()) {
    if (kind.bus == (tcp ? OnBus::kRtu : OnBus::kTcp)) continue;
    for (const RigPhase phase : kind.phases) pairs.push_back({&kind, phase});
  }
  std::mt19937_64 random(seed);
  std::vector<Injection> plan;
  for (int i = 0; i < count; ++i) {
    const std::size_t at = static_cast<std::size_t>(i) % pairs.size();
    // Not std::shuffle: its draws are each library's own.
    if (at == 0) {
      for (std::size_t k = pairs.size() - 1; k > 0; --k)
        std::swap(pairs[k], pairs[random() % (k + 1)]);
    }
    Injection injection = pairs[at];
    injection.device = static_cast<int>(random() % ServedRig::kAxes);
    injection.delay_s = 0.05 + 0.3 * static_cast<double>(random() % 1000) / 1000.0;
    if (i % shards == shard) plan.push_back(injection);
  }
  return plan;
}

}  // namespace tenter::campaign
