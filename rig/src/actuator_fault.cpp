// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/actuator_fault.h"

#include <algorithm>
#include <array>

namespace tenter {
namespace {

struct FaultText {
  ActuatorFault fault;
  std::string_view name, reason, advice;
};

constexpr std::array kFaultTexts = {
    FaultText{ActuatorFault::kNone, "none", "no fault", ""},
    FaultText{ActuatorFault::kTimeout, "timeout", "the actuator did not answer in time",
              "check its cable, its hub and its supply"},
    FaultText{ActuatorFault::kStall, "stall", "the actuator refused a request",
              "check that the model and its firmware are those of the configuration"},
    FaultText{ActuatorFault::kProtocolError, "protocol-error", "a USB transfer failed on the wire",
              "check the cable and keep it away from motor leads"},
    FaultText{ActuatorFault::kShortReply, "short-reply", "an answer was cut short",
              "check the cable and the hub"},
    FaultText{ActuatorFault::kWrongReply, "wrong-reply", "an answer cannot be true",
              "check that no other program drives the actuator"},
    FaultText{ActuatorFault::kUnplugged, "unplugged", "the actuator is not on the bus",
              "plug it in and check the serial number of the configuration"},
    FaultText{ActuatorFault::kAccessDenied, "access-denied",
              "the operating system does not open the actuator for this user",
              "install the udev rules and join the group tenter"},
    FaultText{ActuatorFault::kRefused, "refused", "the actuator's settings are not safe",
              "set it up as the rig's manual says, then start again"},
    FaultText{ActuatorFault::kOutOfRange, "out-of-range", "the order is beyond the axis' limits",
              "stay within travel and speed of the configuration"},
    FaultText{ActuatorFault::kHalted, "halted", "motion is refused after a halt",
              "allow motion again once the reason is gone"},
    FaultText{ActuatorFault::kPreempted, "preempted", "a halt cut the operation short", ""},
};

const FaultText& textOf(ActuatorFault fault) {
  const auto row = std::find_if(kFaultTexts.begin(), kFaultTexts.end(),
                                [&](const FaultText& text) { return text.fault == fault; });
  require(row != kFaultTexts.end(), "a fault without a row in its table");
  return *row;
}

}  // namespace

std::string_view actuatorFaultName(ActuatorFault fault) { return textOf(fault).name; }

Error AxisOutcome::error() const {
  const FaultText& text = textOf(fault);
  std::string reason(text.reason);
  if (!detail.empty()) reason += ": " + detail;
  return {ErrorKind::kHardware, "", "axis " + axis, std::move(reason), std::string(text.advice)};
}

}  // namespace tenter
