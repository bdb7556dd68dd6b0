// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tenter/rig/load_cell.h"

namespace tenter {

/// Requests begin with unit and function; no header, no checksum.
std::vector<std::uint8_t> readRequest(int unit, int function, int first, int count);
std::vector<std::uint8_t> writeRequest(int unit, int function, int first,
                                       std::span<const std::uint16_t> words);

/// The request behind a Modbus TCP header.
std::vector<std::uint8_t> tcpFrame(std::uint16_t transaction,
                                   std::span<const std::uint8_t> request);

struct AnswerFrame {
  std::uint16_t transaction = 0;       ///< TCP only.
  std::span<const std::uint8_t> body;  ///< Unit, function, data.
};

/// Whether header and length are those of a Modbus TCP frame.
bool splitTcpFrame(std::span<const std::uint8_t> frame, AnswerFrame& parts);
/// Precondition: the checksum was right.
AnswerFrame splitRtuFrame(std::span<const std::uint8_t> frame);

/// Whether a frame with a wrong checksum begins as the request does: an echo, cut where the byte
/// count of an answer would stand.
bool startsLikeEcho(std::span<const std::uint8_t> request, std::span<const std::uint8_t> frame);

/// Compares an answer with its request. On kNone the registers of a read are in `words`, which has
/// `count` places; a write must come back confirmed.
LoadCellFault checkAnswer(std::span<const std::uint8_t> request, int count,
                          const AnswerFrame& answer, std::span<std::uint16_t> words,
                          std::uint8_t& exception_code);

}  // namespace tenter
