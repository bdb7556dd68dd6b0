// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tenter/rig/usb_exchange.h"

namespace tenter::rig_test {

/// What an operation sent, and how it ended.
struct ScriptRun {
  std::vector<UsbRequest> sent;
  UsbStep end;
};

/// Plays a script against a device that answers each request from its bytes.
inline ScriptRun play(const UsbScript& script,
                      const std::function<std::vector<std::uint8_t>(const UsbRequest&)>& device) {
  ScriptRun run;
  UsbStep step = script(nullptr);
  while (step.request && run.sent.size() < 100) {
    run.sent.push_back(*step.request);
    const UsbReply reply{ActuatorFault::kNone, device(*step.request)};
    step = script(&reply);
  }
  run.end = step;
  return run;
}

}  // namespace tenter::rig_test
