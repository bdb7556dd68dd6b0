// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/lac_protocol.h"

namespace tenter::lac {

std::array<std::uint8_t, kPacketLength> encode(const Packet& packet) {
  require(packet.value >= 0 && packet.value <= kFullScale, "a LAC value outside 0 to 1023");
  return {packet.command, static_cast<std::uint8_t>(packet.value & 0xFF),
          static_cast<std::uint8_t>(packet.value >> 8)};
}

std::optional<Packet> decode(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != kPacketLength) return std::nullopt;
  const int value = bytes[1] | bytes[2] << 8;
  if (value > kFullScale) return std::nullopt;
  return Packet{bytes[0], value};
}

}  // namespace tenter::lac
