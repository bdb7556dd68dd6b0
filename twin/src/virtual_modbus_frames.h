// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tenter/twin/virtual_cell.h"

namespace tenter {

using Bytes = std::vector<std::uint8_t>;

std::uint16_t modbusCrc(std::span<const std::uint8_t> bytes);

/// A request without header or checksum.
struct ModbusRequest {
  std::uint16_t transaction = 0;  ///< TCP only.
  int unit = 0;
  Bytes pdu;    ///< Function and data.
  Bytes frame;  ///< As it came over the wire.
};

/// Takes the first whole request off the front; nothing if there is none yet. Bytes that cannot
/// begin one are dropped (RTU: all of them) or set `broken` (TCP).
std::optional<ModbusRequest> takeRtuRequest(Bytes& input);
std::optional<ModbusRequest> takeTcpRequest(Bytes& input, bool& broken);

/// What goes out for one request, and when.
struct ModbusReply {
  Bytes bytes;
  std::chrono::nanoseconds delay{};     ///< On top of the turnaround.
  std::chrono::nanoseconds per_byte{};  ///< Between bytes, on top of their time on the wire.
  bool hang_up = false;
  bool regular = true;  ///< Whole and in time.
};

/// Lets the cell answer, or fail as scripted.
ModbusReply replyTo(const ModbusRequest& request, VirtualCell& cell, bool tcp);
/// The answer of a gateway that has no such unit.
Bytes gatewayReply(const ModbusRequest& request);

}  // namespace tenter
