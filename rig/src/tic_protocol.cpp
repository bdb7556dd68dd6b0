// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/tic_protocol.h"

namespace tenter::tic {
namespace {

std::optional<ActuatorState> decodeState(std::uint8_t code) {
  constexpr std::uint8_t kLast = 10;
  if (code > kLast || code % 2 != 0) return std::nullopt;
  return static_cast<ActuatorState>(code / 2);  // 0, 2, 4 ... 10 in the order of the enum
}

}  // namespace

std::uint32_t littleEndian(std::span<const std::uint8_t> data, int offset, int bytes) {
  require(offset >= 0 && offset + bytes <= static_cast<int>(data.size()),
          "a field beyond the end of its block");
  std::uint32_t value = 0;
  for (int i = bytes - 1; i >= 0; --i) value = value << 8 | data[offset + i];
  return value;
}

void putLittleEndian(std::span<std::uint8_t> data, int offset, int bytes, std::uint32_t value) {
  require(offset >= 0 && offset + bytes <= static_cast<int>(data.size()),
          "a field beyond the end of its block");
  for (int i = 0; i < bytes; ++i) data[offset + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

std::optional<Variables> decodeVariables(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < static_cast<std::size_t>(variable::kStatusLength)) return std::nullopt;
  const std::optional<ActuatorState> state = decodeState(bytes[variable::kState]);
  if (!state) return std::nullopt;
  Variables v{};
  v.state = *state;
  v.flags = bytes[variable::kFlags];
  v.errors = static_cast<std::uint16_t>(littleEndian(bytes, variable::kErrors, 2));
  v.errors_occurred = littleEndian(bytes, variable::kErrorsOccurred, 4);
  v.max_speed = littleEndian(bytes, variable::kMaxSpeed, 4);
  v.position = static_cast<std::int32_t>(littleEndian(bytes, variable::kPosition, 4));
  v.velocity = static_cast<std::int32_t>(littleEndian(bytes, variable::kVelocity, 4));
  v.supply_mV = static_cast<std::uint16_t>(littleEndian(bytes, variable::kSupply_mV, 2));
  v.uptime_ms = littleEndian(bytes, variable::kUptime_ms, 4);
  return v;
}

UsbRequest request32(std::uint8_t code, std::uint32_t value) {
  return UsbRequest::controlOut(code, static_cast<std::uint16_t>(value & 0xFFFF),
                                static_cast<std::uint16_t>(value >> 16));
}

}  // namespace tenter::tic
