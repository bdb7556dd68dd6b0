// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "tenter/core/result.h"

namespace tenter {

/// Why an order to an actuator was not carried out, or a reading is missing. A fault never comes
/// with a value.
enum class ActuatorFault {
  kNone,
  kTimeout,        ///< No answer within the stated time.
  kStall,          ///< The device refused the request.
  kProtocolError,  ///< The transfer failed on the wire.
  kShortReply,     ///< Fewer bytes than a complete answer has.
  kWrongReply,     ///< An answer that cannot be true, or to another question.
  kUnplugged,      ///< The device is not (any longer) on the bus.
  kAccessDenied,   ///< The operating system does not let this user open it.
  kRefused,        ///< The device did not accept a setting that safety rests on.
  kOutOfRange,     ///< A target, speed or position beyond what the axis may do; nothing was sent.
  kHalted,         ///< Motion stays refused after a halt until it is allowed again.
  kPreempted,      ///< A halt of another thread cut this operation short.
};

/// The name that logs and sessions carry, such as "short-reply".
std::string_view actuatorFaultName(ActuatorFault fault);

/// What became of one operation on one axis.
struct [[nodiscard]] AxisOutcome {
  ActuatorFault fault = ActuatorFault::kNone;
  std::string axis;    ///< Name of the axis.
  std::string detail;  ///< The request and what happened to it; empty if all is well.

  bool ok() const { return fault == ActuatorFault::kNone; }
  /// Precondition: !ok(). Kind kHardware; place is the axis.
  Error error() const;
};

}  // namespace tenter
