// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tenter/rig/actuator_fault.h"

namespace tenter {

/// One USB transfer: a control request on endpoint 0, or bytes through a bulk endpoint.
struct UsbRequest {
  std::uint8_t endpoint = 0;  ///< 0: control. Bulk IN endpoints have bit 7 set.
  std::uint8_t type = 0x40, code = 0;
  std::uint16_t value = 0, index = 0;
  std::vector<std::uint8_t> out;   ///< Bytes for a bulk OUT endpoint.
  int reply_length = 0;            ///< Bytes of a complete answer; fewer are a fault.
  int max_reply_length = 0;        ///< Room for the answer, if it may be longer than that.
  bool silence_is_answer = false;  ///< Draining: a time-out after a few milliseconds is expected.

  static UsbRequest controlOut(std::uint8_t code, std::uint16_t value = 0, std::uint16_t index = 0);
  static UsbRequest controlIn(std::uint8_t code, std::uint16_t index, int length);
  static UsbRequest stringDescriptor(std::uint8_t index);
  static UsbRequest bulkOut(std::uint8_t endpoint, std::vector<std::uint8_t> bytes);
  static UsbRequest bulkIn(std::uint8_t endpoint, int length);
  static UsbRequest drain(std::uint8_t endpoint, int max_length);

  /// "request A1 index 0" for messages.
  std::string name() const;
};

struct UsbReply {
  ActuatorFault fault = ActuatorFault::kNone;
  std::vector<std::uint8_t> data;
};

/// What an operation does next: one more request, or nothing more and how it ended.
struct UsbStep {
  std::optional<UsbRequest> request;
  ActuatorFault fault = ActuatorFault::kNone;
  std::string detail;

  static UsbStep send(UsbRequest request) { return {std::move(request), ActuatorFault::kNone, ""}; }
  static UsbStep done() { return {}; }
  static UsbStep fail(ActuatorFault fault, std::string detail) {
    return {std::nullopt, fault, std::move(detail)};
  }
};

/// An operation as a dialogue: called with null first and then with each complete answer, which is
/// never a faulty one: a fault ends the operation. Runs on the thread that asked for the operation.
using UsbScript = std::function<UsbStep(const UsbReply* previous)>;

/// Sends these in order and looks at no answer.
UsbScript usbSequence(std::vector<UsbRequest> requests);

/// Sends nothing and ends so.
UsbScript usbFailure(ActuatorFault fault, std::string detail);

}  // namespace tenter
