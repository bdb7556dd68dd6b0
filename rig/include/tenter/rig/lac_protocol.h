// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "tenter/rig/actuator_driver.h"

/// The Actuonix LAC on USB: packets [command, low, high] on bulk endpoints, each answered by one
/// that repeats the command [LacGuide].
namespace tenter::lac {

inline constexpr std::uint16_t kVendor = 0x04D8;
inline constexpr std::array<UsbProduct, 1> kProducts = {{{0xFC5F, "Actuonix LAC"}}};
inline constexpr std::uint8_t kEndpointOut = 0x01, kEndpointIn = 0x81;
inline constexpr int kPacketLength = 3;
inline constexpr int kFullScale = 1023;  ///< Of position and of speed.

namespace command {
inline constexpr std::uint8_t kSetAccuracy = 0x01, kSetRetractLimit = 0x02, kSetExtendLimit = 0x03,
                              kSetStallTime = 0x05, kGetFeedback = 0x10, kSetPosition = 0x20,
                              kSetSpeed = 0x21, kDisableManual = 0x30, kReset = 0xFF;
}  // namespace command

struct Packet {
  std::uint8_t command;
  int value;  ///< 0 to kFullScale.
};

std::array<std::uint8_t, kPacketLength> encode(const Packet& packet);

/// Nothing unless there are exactly three bytes and the value is within scale.
std::optional<Packet> decode(std::span<const std::uint8_t> bytes);

}  // namespace tenter::lac
