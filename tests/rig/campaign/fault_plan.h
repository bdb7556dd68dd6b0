// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "tenter/twin/fault_script.h"

namespace tenter::campaign {

/// Who is befallen.
enum class Part { kCell, kAxis, kProgram };

/// Buses of load cells on which a fault exists: a serial line has nothing to hang up, TCP no CRC.
enum class OnBus { kBoth, kTcp, kRtu };

/// One kind of fault, and what has to follow from it.
struct FaultKindRow {
  std::string name;  ///< As in fault scripts; of programs: as in programFault().
  Part part = Part::kCell;
  OnBus bus = OnBus::kBoth;
  bool once = false;            ///< Befalls one request or transfer: motion may go on.
  int bound_ms = 0;             ///< Until nothing loads any more, where `halts`.
  std::set<std::string> names;  ///< One of these is in log and session.
  std::set<RigPhase> phases;    ///< In which it can be seen at all.
};

const std::vector<FaultKindRow>& faultKinds();

/// What is injected, when and where.
struct Injection {
  const FaultKindRow* kind = nullptr;
  RigPhase phase = RigPhase::kIdle;
  int device = 0;        ///< Of cells or axes.
  double delay_s = 0.0;  ///< After the phase has begun.
};

/// The first `count` injections of this seed: kinds x phases in turn, shuffled, devices and
/// moments by chance. Every `shards`-th, from `shard`.
std::vector<Injection> makePlan(std::uint64_t seed, int count, int shard, int shards, bool tcp);

}  // namespace tenter::campaign
