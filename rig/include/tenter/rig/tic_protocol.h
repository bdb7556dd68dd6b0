// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "tenter/rig/actuator_driver.h"

/// The Pololu Tic on USB: vendor requests on endpoint 0 [TicGuide sec. 6-8, 11].
namespace tenter::tic {

inline constexpr std::uint16_t kVendor = 0x1FFB;
inline constexpr std::array<UsbProduct, 6> kProducts = {{{0x00B3, "Tic T825"},
                                                         {0x00B5, "Tic T834"},
                                                         {0x00BD, "Tic T500"},
                                                         {0x00C3, "Tic N825"},
                                                         {0x00C9, "Tic T249"},
                                                         {0x00CB, "Tic 36v4"}}};

/// Request codes. 32-bit values go as value (low half) and index (high half).
namespace command {
inline constexpr std::uint8_t kSetTargetPosition = 0xE0, kSetTargetVelocity = 0xE3,
                              kHaltAndSetPosition = 0xEC, kHaltAndHold = 0x89, kGoHome = 0x97,
                              kResetCommandTimeout = 0x8C, kEnergise = 0x85, kDeenergise = 0x86,
                              kExitSafeStart = 0x83, kEnterSafeStart = 0x8F, kReset = 0xB0,
                              kClearDriverError = 0x8A, kSetMaxSpeed = 0xE6,
                              kSetStartingSpeed = 0xE5, kSetMaxAcceleration = 0xEA,
                              kSetMaxDeceleration = 0xE9, kGetVariable = 0xA1,
                              kGetVariableAndClearErrors = 0xA2, kGetSetting = 0xA8,
                              kSetSetting = 0x13, kReinitialise = 0x10;
}  // namespace command

/// Offsets of variables, little-endian.
namespace variable {
inline constexpr int kState = 0x00, kFlags = 0x01, kErrors = 0x02, kErrorsOccurred = 0x04,
                     kPlanningMode = 0x09, kTargetPosition = 0x0A, kTargetVelocity = 0x0E,
                     kStartingSpeed = 0x12, kMaxSpeed = 0x16, kMaxDeceleration = 0x1A,
                     kMaxAcceleration = 0x1E, kPosition = 0x22, kVelocity = 0x26, kSupply_mV = 0x33,
                     kUptime_ms = 0x35, kCount = 0x55;
/// The driver reads this many from 0 in one request.
inline constexpr int kStatusLength = 0x39;
}  // namespace variable

/// Offsets of settings in non-volatile memory; in force after kReinitialise or a reset.
namespace setting {
inline constexpr int kControlMode = 0x01, kDisableSafeStart = 0x03, kAutoClearDriverError = 0x08,
                     kCommandTimeout_ms = 0x09, kMaxSpeed = 0x47, kMaxDeceleration = 0x4B,
                     kMaxAcceleration = 0x4F, kSoftErrorResponse = 0x53, kKillSwitchMap = 0x5D,
                     kForwardLimitMap = 0x5F, kReverseLimitMap = 0x60, kHomingTowards = 0x61,
                     kHomingAway = 0x65, kCount = 0x69;
}  // namespace setting

enum Flag : std::uint8_t {
  kEnergised = 1 << 0,
  kPositionUncertain = 1 << 1,
  kForwardLimit = 1 << 2,
  kReverseLimit = 1 << 3,
  kHoming = 1 << 4,
};
enum SoftErrorResponse : std::uint8_t { kDeenergiseMotor = 0, kHalt = 1, kDecelerate = 2 };

inline constexpr double kSpeedUnitsPerStep = 10'000.0;      // microsteps per 10,000 s
inline constexpr double kAccelerationUnitsPerStep = 100.0;  // microsteps per 100 s^2
inline constexpr double kMaxSpeedUnits = 500'000'000.0;
inline constexpr std::uint32_t kMinAccelerationUnits = 100;
inline constexpr std::uint8_t kControlModeSerial = 0;

/// Variables in the device's units.
struct Variables {
  ActuatorState state;
  std::uint8_t flags;
  std::uint16_t errors;
  std::uint32_t errors_occurred;
  std::uint32_t max_speed;
  std::int32_t position, velocity;
  std::uint16_t supply_mV;
  std::uint32_t uptime_ms;
};

/// Nothing if there are fewer than kStatusLength bytes or the operation state is none that exists.
std::optional<Variables> decodeVariables(std::span<const std::uint8_t> bytes);

/// Little-endian number of `bytes` bytes. Precondition: offset + bytes <= data.size().
std::uint32_t littleEndian(std::span<const std::uint8_t> data, int offset, int bytes);
void putLittleEndian(std::span<std::uint8_t> data, int offset, int bytes, std::uint32_t value);

/// The request that carries a 32-bit number.
UsbRequest request32(std::uint8_t code, std::uint32_t value);

}  // namespace tenter::tic
