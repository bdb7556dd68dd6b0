// SPDX-License-Identifier: GPL-3.0-or-later
#include "virtual_modbus_frames.h"

namespace tenter {
namespace {

using Kind = VirtualCellFaultKind;

constexpr std::size_t kTcpHeader = 6;
constexpr std::size_t kLongestPdu = 253;
constexpr std::uint8_t kExceptionFlag = 0x80;
constexpr std::uint8_t kGatewayTargetFailed = 11;

void append16(Bytes& bytes, int word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word));
}

int word16(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] << 8 | bytes[at + 1];
}

Bytes exceptionPdu(const ModbusRequest& request, int code) {
  return {static_cast<std::uint8_t>(request.pdu[0] | kExceptionFlag),
          static_cast<std::uint8_t>(code)};
}

Bytes readPdu(const ModbusRequest& request, VirtualCell& cell) {
  if (request.pdu.size() != 5) return exceptionPdu(request, 3);
  std::vector<std::uint16_t> words;
  const int function = request.pdu[0];
  const std::uint8_t code =
      cell.read(function, word16(request.pdu, 1), word16(request.pdu, 3), words);
  if (code != 0) return exceptionPdu(request, code);
  Bytes pdu{request.pdu[0], static_cast<std::uint8_t>(2 * words.size())};
  for (const std::uint16_t word : words) append16(pdu, word);
  return pdu;
}

Bytes writePdu(const ModbusRequest& request, VirtualCell& cell) {
  const Bytes& pdu = request.pdu;
  std::vector<std::uint16_t> words;
  if (pdu[0] == 6 && pdu.size() == 5) {
    words.push_back(static_cast<std::uint16_t>(word16(pdu, 3)));
  } else if (pdu[0] == 16 && pdu.size() >= 6 && pdu[5] == 2 * word16(pdu, 3) &&
             pdu.size() == 6U + pdu[5]) {
    for (std::size_t at = 6; at < pdu.size(); at += 2) {
      words.push_back(static_cast<std::uint16_t>(word16(pdu, at)));
    }
  } else {
    return exceptionPdu(request, 3);
  }
  const std::uint8_t code = cell.write(pdu[0], word16(pdu, 1), words);
  if (code != 0) return exceptionPdu(request, code);
  return {pdu.begin(), pdu.begin() + 5};
}

Bytes answerPdu(const ModbusRequest& request, VirtualCell& cell) {
  switch (request.pdu[0]) {
    case 3:
    case 4:
      return readPdu(request, cell);
    case 6:
    case 16:
      return writePdu(request, cell);
    default:
      return exceptionPdu(request, 1);
  }
}

Bytes frameOf(const ModbusRequest& request, int unit, const Bytes& pdu, bool tcp) {
  Bytes frame;
  if (tcp) {
    append16(frame, request.transaction);
    append16(frame, 0);
    append16(frame, static_cast<int>(pdu.size()) + 1);
  }
  frame.push_back(static_cast<std::uint8_t>(unit));
  frame.insert(frame.end(), pdu.begin(), pdu.end());
  if (tcp) return frame;
  const std::uint16_t crc = modbusCrc(frame);
  frame.push_back(static_cast<std::uint8_t>(crc));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  return frame;
}

/// A whole answer that says something wrong.
Bytes wrongPdu(const ModbusRequest& request, const VirtualCellFault& fault, Bytes pdu) {
  if (fault.kind == Kind::kException) return exceptionPdu(request, fault.exception_code);
  if (fault.kind == Kind::kWrongFunction) pdu[0] = pdu[0] == 3 ? 4 : 3;
  if (fault.kind == Kind::kWrongCount && pdu.size() > 4) {
    pdu[1] = static_cast<std::uint8_t>(pdu[1] - 2);
    pdu.resize(pdu.size() - 2);
  }
  return pdu;
}

/// What the wire does to a whole answer.
void spoil(ModbusReply& reply, const VirtualCellFault& fault, const ModbusRequest& request) {
  switch (fault.kind) {
    case Kind::kSilence:
      reply.bytes.clear();
      break;
    case Kind::kHangUp:
      reply.bytes.clear();
      reply.hang_up = true;
      break;
    case Kind::kBadCrc:
      reply.bytes[reply.bytes.size() / 2] ^= 0x10;  // in the data, which the checksum then belies
      break;
    case Kind::kHalfFrame:
      reply.bytes.resize(reply.bytes.size() / 2);
      break;
    case Kind::kDribble:
      reply.per_byte = fault.delay;
      break;
    case Kind::kLateAnswer:
      reply.delay = fault.delay;
      break;
    case Kind::kEcho:
      reply.bytes.insert(reply.bytes.begin(), request.frame.begin(), request.frame.end());
      break;
    case Kind::kTrailingBytes:
      reply.bytes.insert(reply.bytes.end(), {0xAA, 0x01, 0x03});
      break;
    default:
      break;
  }
}

}  // namespace

std::uint16_t modbusCrc(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1) ^ 0xA001U : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

std::optional<ModbusRequest> takeRtuRequest(Bytes& input) {
  if (input.size() < 2) return std::nullopt;
  std::size_t length = 8;
  if (input[1] == 16) {
    if (input.size() < 7) return std::nullopt;
    length = 9U + input[6];
  }
  if (input.size() < length) return std::nullopt;
  const std::span<const std::uint8_t> body(input.data(), length - 2);
  const std::uint16_t crc = modbusCrc(body);
  const bool good = input[length - 2] == (crc & 0xFF) && input[length - 1] == (crc >> 8);
  if (!good) {
    input.clear();
    return std::nullopt;
  }
  ModbusRequest request;
  request.unit = input[0];
  request.pdu.assign(body.begin() + 1, body.end());
  const auto end = input.begin() + static_cast<std::ptrdiff_t>(length);
  request.frame.assign(input.begin(), end);
  input.erase(input.begin(), end);
  return request;
}

std::optional<ModbusRequest> takeTcpRequest(Bytes& input, bool& broken) {
  if (input.size() < kTcpHeader) return std::nullopt;
  const auto length = static_cast<std::size_t>(word16(input, 4));
  broken = word16(input, 2) != 0 || length < 2 || length > kLongestPdu + 1;
  if (broken || input.size() < kTcpHeader + length) return std::nullopt;
  ModbusRequest request;
  request.transaction = static_cast<std::uint16_t>(word16(input, 0));
  request.unit = input[kTcpHeader];
  const auto end = input.begin() + static_cast<std::ptrdiff_t>(kTcpHeader + length);
  request.pdu.assign(input.begin() + kTcpHeader + 1, end);
  request.frame.assign(input.begin(), end);
  input.erase(input.begin(), end);
  return request;
}

ModbusReply replyTo(const ModbusRequest& request, VirtualCell& cell, bool tcp) {
  ModbusReply reply;
  std::optional<VirtualCellFault> fault = cell.takeWireFault();
  if (fault && !canBefall(fault->kind, tcp)) fault.reset();
  Bytes pdu = answerPdu(request, cell);
  if (fault) pdu = wrongPdu(request, *fault, std::move(pdu));
  const bool wrong_unit = fault && fault->kind == Kind::kWrongUnit;
  reply.bytes = frameOf(request, wrong_unit ? request.unit + 1 : request.unit, pdu, tcp);
  if (!fault) return reply;
  reply.regular = false;
  spoil(reply, *fault, request);
  return reply;
}

Bytes gatewayReply(const ModbusRequest& request) {
  return frameOf(request, request.unit, exceptionPdu(request, kGatewayTargetFailed), true);
}

}  // namespace tenter
