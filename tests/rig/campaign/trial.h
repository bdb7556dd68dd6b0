// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "trial_rig.h"

namespace tenter::campaign {

/// What became of one injection.
struct Verdict {
  Injection injection;
  std::vector<std::string> problems;  ///< Empty: all was as it must be.
  double loading_ms = 0.0;            ///< From the injection to the last loading movement.
  double motion_ms = 0.0;             ///< To the last movement of any axis.
  int values = 0, wrong_values = 0;   ///< Tensions that the daemon stated, against the truth.
  double longest_call_s = 0.0;
  int overlong_calls = 0;  ///< Of devices, beyond twice their time-out.
  int disturbed = 0;       ///< Attempts before it in which the rig halted for another reason.

  nlohmann::json json() const;
};

/// One injection into a rig that is ready; leaves it to recover(). Throws if the rig halts before
/// the injection.
Verdict tryFault(TrialRig& trial, const Injection& injection);

}  // namespace tenter::campaign
