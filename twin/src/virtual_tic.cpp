// SPDX-License-Identifier: GPL-3.0-or-later
// What the Tic is told and says; virtual_tic_motion.cpp is how it moves.
#include "virtual_tic.h"

#include <algorithm>
#include <cerrno>
#include <cmath>

namespace tenter {
namespace {

using namespace tic;  // NOLINT(google-build-using-namespace): this file is the Tic's
using namespace std::chrono_literals;

constexpr std::uint16_t kFirmware = 0x0107;
constexpr std::uint16_t kSupply_mV = 12'000, kLowSupply_mV = 4'100;
constexpr std::chrono::milliseconds kSafeStartPardon = 200ms;
constexpr std::uint8_t kVendorOut = 0x40, kVendorIn = 0xC0;
constexpr std::uint8_t kSwitchOnPin = 1, kKillSwitchPin = 8;

// The maker's defaults.
constexpr std::uint16_t kDefaultTimeout_ms = 1000;
constexpr std::uint32_t kDefaultMaxSpeed = 2'000'000, kDefaultAcceleration = 40'000;
constexpr std::uint32_t kDefaultHomingSpeed = 1'000'000;

}  // namespace

std::unique_ptr<VirtualUsbModel> makeVirtualTic(const VirtualActuatorSpec& spec) {
  return std::make_unique<VirtualTic>(spec);
}

VirtualTic::VirtualTic(const VirtualActuatorSpec& spec)
    : spec_(spec), true_position_(spec.start_units) {
  settings_[setting::kAutoClearDriverError] = 1;
  settings_[setting::kSoftErrorResponse] = kDecelerate;
  settings_[setting::kForwardLimitMap] = spec.forward_switch_units ? kSwitchOnPin : 0;
  settings_[setting::kReverseLimitMap] = spec.reverse_switch_units ? kSwitchOnPin : 0;
  settings_[setting::kKillSwitchMap] = kKillSwitchPin;  // as the rig's builder sets it
  putLittleEndian(settings_, setting::kCommandTimeout_ms, 2, kDefaultTimeout_ms);
  putLittleEndian(settings_, setting::kMaxSpeed, 4, kDefaultMaxSpeed);
  putLittleEndian(settings_, setting::kMaxAcceleration, 4, kDefaultAcceleration);
  putLittleEndian(settings_, setting::kHomingTowards, 4, kDefaultHomingSpeed);
  putLittleEndian(settings_, setting::kHomingAway, 4, kDefaultHomingSpeed);
}

std::vector<std::uint8_t> VirtualTic::descriptors() const {
  return vendorDescriptors(kVendor, spec_.product, kFirmware, {});
}

const char* VirtualTic::product() const {
  const auto row = std::find_if(kProducts.begin(), kProducts.end(), [&](const UsbProduct& known) {
    return known.product == spec_.product;
  });
  return row == kProducts.end() ? "Tic" : row->name.data();
}

std::uint32_t VirtualTic::stored(int offset, int bytes) const {
  return littleEndian(active_, offset, bytes);
}

void VirtualTic::powerUp(Time now) {
  now_ = last_command_ = power_up_ = now;
  intentionally_off_ = uncertain_ = true;
  occurred_ = 0;
  counted_ = 0.0;
  reset();
}

void VirtualTic::loadSettings() {
  active_ = settings_;
  max_speed_ = stored(setting::kMaxSpeed, 4);
  acceleration_ = stored(setting::kMaxAcceleration, 4);
  deceleration_ = stored(setting::kMaxDeceleration, 4);
  starting_speed_ = 0;
}

void VirtualTic::reset() {
  loadSettings();
  planning_ = Planning::kOff;
  homing_ = Homing::kNone;
  velocity_ = 0.0;
  driver_error_ = timed_out_ = false;
  safe_start_ = true;
  pardon_until_ = Time{0};
  judge();
}

void VirtualTic::setCondition(VirtualFault condition, bool on) {
  switch (condition) {
    case VirtualFault::kKillSwitch:
      kill_switch_ = on;
      break;
    case VirtualFault::kUnderVoltage:
      low_supply_ = on;
      break;
    case VirtualFault::kDriverError:
      driver_fails_ = on;
      driver_error_ = on || (driver_error_ && settings_[setting::kAutoClearDriverError] == 0);
      break;
    case VirtualFault::kForwardLimit:
      forward_forced_ = on;
      break;
    case VirtualFault::kReverseLimit:
      reverse_forced_ = on;
      break;
    case VirtualFault::kJammed:
      jammed_ = on;
      break;
    case VirtualFault::kSettingsLocked:
      locked_ = on;
      break;
    default:
      break;
  }
  judge();
}

void VirtualTic::judge() {
  using namespace actuator_error;  // NOLINT(google-build-using-namespace)
  std::uint32_t others = 0;
  if (intentionally_off_) others |= kDeenergised;
  if (driver_error_) others |= kDriver;
  if (low_supply_) others |= kLowSupply;
  if (kill_switch_) others |= actuator_error::kKillSwitch;
  if (timed_out_) others |= kCommandTimeout;
  if (others != 0 && now_ >= pardon_until_) safe_start_ = true;
  errors_ = others | (safe_start_ ? kSafeStart : 0);
  occurred_ |= errors_;
  if ((errors_ & (kDriver | kLowSupply)) != 0) {
    operation_ = ActuatorState::kReset;
  } else if ((errors_ & kDeenergised) != 0) {
    operation_ = ActuatorState::kDeenergised;
  } else {
    operation_ = errors_ != 0 ? ActuatorState::kSoftError : ActuatorState::kNormal;
  }
  if (operation_ == ActuatorState::kNormal) return;
  homing_ = Homing::kNone;
  const bool ramp = operation_ == ActuatorState::kSoftError &&
                    active_[setting::kSoftErrorResponse] == kDecelerate;
  if (!ramp) halt();
}

void VirtualTic::goHome(bool forward) {
  const int map = forward ? setting::kForwardLimitMap : setting::kReverseLimitMap;
  if (active_[map] == 0 || operation_ != ActuatorState::kNormal) return;  // the device ignores it
  homing_ = Homing::kTowards;
  homing_forward_ = forward;
  planning_ = Planning::kOff;
  uncertain_ = true;
}

int VirtualTic::control(const UsbSetup& setup, std::span<std::uint8_t> data, int& actual) {
  actual = 0;
  const auto answer = [&](std::span<const std::uint8_t> from) {
    if (setup.index + data.size() > from.size()) return -EPIPE;
    std::copy_n(from.begin() + setup.index, data.size(), data.begin());
    actual = static_cast<int>(data.size());
    return 0;
  };
  if (setup.type == kVendorIn) {
    switch (setup.request) {
      case command::kGetVariable:
        return answer(variables());
      case command::kGetVariableAndClearErrors: {
        const int status = answer(variables());
        if (status == 0) occurred_ = 0;
        return status;
      }
      case command::kGetSetting:
        return answer(settings_);
      default:
        return -EPIPE;
    }
  }
  if (setup.type != kVendorOut) return -EPIPE;
  if (setup.request == command::kSetSetting) {
    if (setup.index >= settings_.size()) return -EPIPE;
    if (!locked_) settings_[setup.index] = static_cast<std::uint8_t>(setup.value);
    return 0;
  }
  return order(setup.request, setup.value | static_cast<std::uint32_t>(setup.index) << 16);
}

int VirtualTic::order(std::uint8_t code, std::uint32_t value) {
  const auto heard = [&] {
    last_command_ = now_;
    timed_out_ = false;
  };
  const auto plan = [&](Planning planning) {
    heard();
    homing_ = Homing::kNone;
    planning_ = planning;
  };
  switch (code) {
    case command::kSetTargetPosition:
      plan(Planning::kPosition);
      target_position_ = static_cast<std::int32_t>(value);
      break;
    case command::kSetTargetVelocity:
      plan(Planning::kVelocity);
      target_velocity_ = static_cast<std::int32_t>(value);
      break;
    case command::kHaltAndHold:
      plan(Planning::kOff);
      halt();
      break;
    case command::kHaltAndSetPosition:
      plan(Planning::kOff);
      halt();
      counted_ = static_cast<std::int32_t>(value);
      uncertain_ = false;
      break;
    case command::kResetCommandTimeout:
      heard();
      break;
    case command::kEnergise:
      heard();
      intentionally_off_ = false;
      break;
    case command::kExitSafeStart:
      heard();
      safe_start_ = false;
      pardon_until_ = now_ + kSafeStartPardon;
      break;
    case command::kReset:
      heard();
      reset();
      break;
    case command::kDeenergise:
      intentionally_off_ = true;
      uncertain_ = true;
      break;
    case command::kEnterSafeStart:
      safe_start_ = true;
      pardon_until_ = Time{0};
      break;
    case command::kClearDriverError:
      driver_error_ = driver_fails_;
      break;
    case command::kGoHome:
      goHome(value == 1);
      break;
    case command::kSetMaxSpeed:
      max_speed_ = std::min(value, static_cast<std::uint32_t>(kMaxSpeedUnits));
      break;
    case command::kSetStartingSpeed:
      starting_speed_ = value;
      break;
    case command::kSetMaxAcceleration:
      acceleration_ = std::max(value, kMinAccelerationUnits);
      break;
    case command::kSetMaxDeceleration:
      deceleration_ = value == 0 ? 0 : std::max(value, kMinAccelerationUnits);
      break;
    case command::kReinitialise:
      loadSettings();
      break;
    default:
      return -EPIPE;
  }
  judge();
  return 0;
}

std::vector<std::uint8_t> VirtualTic::variables() const {
  std::vector<std::uint8_t> bytes(variable::kCount, 0);
  const auto put = [&](int offset, int length, std::uint32_t value) {
    putLittleEndian(bytes, offset, length, value);
  };
  const auto speed = static_cast<std::int32_t>(std::lround(velocity_ * kSpeedUnitsPerStep));
  const auto count = static_cast<std::int32_t>(std::lround(counted_));
  const auto uptime = std::chrono::duration_cast<std::chrono::milliseconds>(now_ - power_up_);
  std::uint8_t flags = state().energised ? kEnergised : 0;
  if (uncertain_) flags |= kPositionUncertain;
  if (limit(true)) flags |= kForwardLimit;
  if (limit(false)) flags |= kReverseLimit;
  if (homing_ != Homing::kNone) flags |= kHoming;
  put(variable::kState, 1, 2 * static_cast<std::uint32_t>(operation_));
  put(variable::kFlags, 1, flags);
  put(variable::kErrors, 2, errors_);
  put(variable::kErrorsOccurred, 4, occurred_);
  put(variable::kPlanningMode, 1, static_cast<std::uint32_t>(planning_));
  put(variable::kTargetPosition, 4, static_cast<std::uint32_t>(target_position_));
  put(variable::kTargetVelocity, 4, static_cast<std::uint32_t>(target_velocity_));
  put(variable::kStartingSpeed, 4, starting_speed_);
  put(variable::kMaxSpeed, 4, max_speed_);
  put(variable::kMaxDeceleration, 4, deceleration_);
  put(variable::kMaxAcceleration, 4, acceleration_);
  put(variable::kPosition, 4, static_cast<std::uint32_t>(count));
  put(variable::kVelocity, 4, static_cast<std::uint32_t>(speed));
  put(variable::kSupply_mV, 2, low_supply_ ? kLowSupply_mV : kSupply_mV);
  put(variable::kUptime_ms, 4, static_cast<std::uint32_t>(uptime.count()));
  return bytes;
}

VirtualActuatorState VirtualTic::state() const {
  VirtualActuatorState state;
  state.position_units = true_position_;
  state.velocity_units_per_s = jammed_ ? 0.0 : velocity_;
  state.counted_units = counted_;
  state.energised = operation_ == ActuatorState::kSoftError || operation_ == ActuatorState::kNormal;
  state.homing = homing_ != Homing::kNone;
  return state;
}

// It has no endpoint but 0.
int VirtualTic::bulkOut(std::span<const std::uint8_t>) { return -ENOENT; }
int VirtualTic::bulkIn(std::span<std::uint8_t>, int&) { return -ENOENT; }

}  // namespace tenter
