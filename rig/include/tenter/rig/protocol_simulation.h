// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tenter/rig/protocol.h"

namespace tenter {

/// A protocol carried out by the rig's own machine where every cord hangs on a spring of its own,
/// slack at the axes' ends. Nothing moves.
struct ProtocolRun {
  double stiffness_N_per_m = 0.0;  ///< Of each spring.
  bool completed = false;          ///< And unloaded.
  std::string fault;               ///< Otherwise: "axis-1: travel", with the phase and step.
  double duration_s = 0.0;         ///< Unloading included.
  double highest_force_N = 0.0;    ///< Gross, of one cord.
  double longest_way_m = 0.0;      ///< Of one axis, from where the run began.
  std::int64_t captures = 0;
};
/// Precondition: checkAgainstRig() allows it, and 0 < stiffness.
ProtocolRun simulateProtocol(const CaptureProtocol& protocol, const RigConfig& rig,
                             double stiffness_N_per_m);

/// The same for springs from the stiffest sample that the rig is for down to 1/1024 of it, each
/// half as stiff as the one before: too stiff a sample meets the rig's limits, too soft a one never
/// its force.
struct ProtocolForecast {
  std::vector<ProtocolRun> runs;        ///< The stiffest first.
  const ProtocolRun* stiffest() const;  ///< That it completes with; null if none.
  const ProtocolRun* softest() const;
};
ProtocolForecast forecastProtocol(const CaptureProtocol& protocol, const RigConfig& rig);

}  // namespace tenter
