// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "tenter/twin/fault_script.h"

namespace tenter {

/// What truly is at one moment, a number for each axis and its cord.
struct RigSnapshot {
  std::vector<double> positions_m;
  std::vector<double> tensions_N;
  std::vector<bool> homing;
};

/// Tells the phase of a rig from what its devices do. An axis that steps from target to target
/// stands in between, so what has moved within a tenth of a second moves.
class RigPhaseWatch {
 public:
  static constexpr double kMemory_s = 0.1;
  static constexpr double kPulls_N = 0.05;
  RigPhase see(double time_s, const RigSnapshot& now);

 private:
  struct Moved {
    double last_m = 0.0, at_s = -1e9, direction = 0.0;
  };
  std::vector<Moved> axes_;
};

/// A fault that begins or ends now.
struct FaultAction {
  std::size_t fault = 0;  ///< Of the script.
  bool begins = true;
};

/// When the faults of a script begin and end: pure, so that equal snapshots give equal faults.
/// Times count from when the rig is served and never fall.
class FaultSchedule {
 public:
  explicit FaultSchedule(FaultScript script);
  ~FaultSchedule();
  FaultSchedule(const FaultSchedule&) = delete;
  FaultSchedule& operator=(const FaultSchedule&) = delete;

  std::vector<FaultAction> step(double time_s, const RigSnapshot& now);
  const FaultScript& script() const { return script_; }

 private:
  struct State;
  bool triggered(std::size_t index, const RigSnapshot& now, double time_s) const;

  FaultScript script_;
  std::unique_ptr<State> state_;
};

}  // namespace tenter
