// SPDX-License-Identifier: GPL-3.0-or-later
#include "tic_actuator.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tenter {
namespace {

using namespace tic;  // NOLINT(google-build-using-namespace): this file is the Tic's

constexpr double kSlowestSpeedUnits = 7.0;  // the device takes 0 to 6 as 0
// Of the axis' largest speed. The device's own 100 microsteps a second take minutes for a rig's
// travel; away from the switch it goes slowly, because there it finds its zero.
constexpr double kHomingShare = 0.5, kHomingAwayShare = 0.05;

UsbRequest statusRequest() {
  return UsbRequest::controlIn(command::kGetVariable, 0, variable::kStatusLength);
}

UsbRequest settingsRequest() {
  return UsbRequest::controlIn(command::kGetSetting, 0, setting::kCount);
}

UsbRequest settingRequest(int offset, std::uint8_t value) {
  return UsbRequest::controlOut(command::kSetSetting, value, static_cast<std::uint16_t>(offset));
}

UsbScript quick(std::uint8_t code) { return usbSequence({UsbRequest::controlOut(code)}); }

UsbScript outOfRange(const std::string& what, double value) {
  return usbFailure(ActuatorFault::kOutOfRange, what + " " + std::to_string(value));
}

double speedUnits(const AxisConfig& config, double speed_m_per_s) {
  return speed_m_per_s / config.metres_per_unit * kSpeedUnitsPerStep;
}

double accelerationUnits(const AxisConfig& config) {
  return config.max_acceleration_m_per_s2 / std::abs(config.metres_per_unit) *
         kAccelerationUnitsPerStep;
}

/// The position in microsteps, or nothing if it lies outside travel or the counter's range.
std::optional<std::uint32_t> microsteps(const AxisConfig& config, double position_m) {
  if (!(position_m >= config.travel_min_m && position_m <= config.travel_max_m)) return {};
  const double count = std::round((position_m - config.origin_m) / config.metres_per_unit);
  if (std::abs(count) > std::numeric_limits<std::int32_t>::max()) return {};
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(count));
}

/// Writes what differs (the memory wears), puts all of it in force, and asks again.
std::vector<UsbRequest> settingChanges(const AxisConfig& config,
                                       std::span<const std::uint8_t> settings) {
  const auto timeout_ms = static_cast<std::uint32_t>(config.command_timeout.count());
  std::vector<UsbRequest> requests;
  const auto want = [&](int offset, std::uint8_t value) {
    if (settings[offset] != value) requests.push_back(settingRequest(offset, value));
  };
  want(setting::kCommandTimeout_ms, static_cast<std::uint8_t>(timeout_ms & 0xFF));
  want(setting::kCommandTimeout_ms + 1, static_cast<std::uint8_t>(timeout_ms >> 8));
  want(setting::kSoftErrorResponse, kHalt);
  const auto wantSpeed = [&](int offset, double speed_m_per_s) {
    const double units = std::max(std::abs(speedUnits(config, speed_m_per_s)), kSlowestSpeedUnits);
    const auto value = static_cast<std::uint32_t>(units);
    for (int i = 0; i < 4; ++i) want(offset + i, static_cast<std::uint8_t>(value >> (8 * i)));
  };
  wantSpeed(setting::kHomingTowards, kHomingShare * config.max_speed_m_per_s);
  wantSpeed(setting::kHomingAway, kHomingAwayShare * config.max_speed_m_per_s);
  // Always: a setting may have been written by a program that was killed before this request.
  requests.push_back(UsbRequest::controlOut(command::kReinitialise));
  requests.push_back(request32(
      command::kSetMaxSpeed,
      static_cast<std::uint32_t>(std::abs(speedUnits(config, config.max_speed_m_per_s)))));
  requests.push_back(request32(command::kSetMaxAcceleration,
                               static_cast<std::uint32_t>(accelerationUnits(config))));
  requests.push_back(request32(command::kSetMaxDeceleration, 0));  // as acceleration
  requests.push_back(settingsRequest());
  requests.push_back(statusRequest());
  return requests;
}

}  // namespace

Result<void> checkTicConfig(const AxisConfig& config) {
  const std::string place = "axis " + config.name + ": ";
  const double speed = std::abs(speedUnits(config, config.max_speed_m_per_s));
  if (!(speed >= kSlowestSpeedUnits && speed <= kMaxSpeedUnits)) {
    return badInput("", place + "max_speed_m_per_s",
                    "a Tic makes 0.0007 to 50000 microsteps a second",
                    "check metres_per_unit and the step mode");
  }
  const double acceleration = accelerationUnits(config);
  if (!(acceleration >= kMinAccelerationUnits &&
        acceleration <= std::numeric_limits<std::int32_t>::max())) {
    return badInput("", place + "max_acceleration_m_per_s2",
                    "a Tic accelerates by at least 1 microstep/s^2",
                    "check metres_per_unit and the step mode");
  }
  for (const double end_m : {config.travel_min_m, config.travel_max_m}) {
    if (!microsteps(config, end_m)) {
      return badInput("", place + "travel", "its ends lie outside the Tic's counter");
    }
  }
  return {};
}

UsbScript TicActuator::start() {
  enum class Wait { kFirst, kSettings, kChanges };
  return [this, wait = Wait::kFirst, changes = std::vector<UsbRequest>(),
          next = std::size_t{0}](const UsbReply* previous) mutable {
    if (wait == Wait::kFirst) {
      wait = Wait::kSettings;
      return UsbStep::send(settingsRequest());
    }
    if (wait == Wait::kSettings) {
      if (previous->data[setting::kControlMode] != kControlModeSerial) {
        return UsbStep::fail(
            ActuatorFault::kRefused,
            "its control mode is not \"Serial / I2C / USB\", so it would not obey");
      }
      if (previous->data[setting::kDisableSafeStart] != 0) {
        return UsbStep::fail(ActuatorFault::kRefused, "its safe start is disabled");
      }
      if (config_.kill_switch && previous->data[setting::kKillSwitchMap] == 0) {
        return UsbStep::fail(
            ActuatorFault::kRefused,
            "no pin of it is a kill switch, so the emergency stop would not be seen (set one in "
            "its settings, or say kill_switch = false in the rig's file)");
      }
      wait = Wait::kChanges;
      changes = settingChanges(config_, previous->data);
      return UsbStep::send(changes[next++]);
    }
    if (next == changes.size()) return takeStatus(*previous);
    if (next + 1 == changes.size()) {  // the answer is that of settingsRequest()
      UsbStep verdict = checkSettings(*previous);
      if (verdict.fault != ActuatorFault::kNone) return verdict;
    }
    return UsbStep::send(changes[next++]);
  };
}

UsbStep TicActuator::checkSettings(const UsbReply& reply) const {
  const std::uint32_t timeout_ms = littleEndian(reply.data, setting::kCommandTimeout_ms, 2);
  if (timeout_ms != static_cast<std::uint32_t>(config_.command_timeout.count())) {
    return UsbStep::fail(ActuatorFault::kRefused,
                         "its command time-out is " + std::to_string(timeout_ms) + " ms and not " +
                             std::to_string(config_.command_timeout.count()) + " ms");
  }
  if (reply.data[setting::kSoftErrorResponse] != kHalt) {
    return UsbStep::fail(ActuatorFault::kRefused,
                         "its soft error response is not \"halt and hold\"");
  }
  return UsbStep::done();
}

UsbScript TicActuator::readStatus() {
  return [this](const UsbReply* previous) {
    return previous == nullptr ? UsbStep::send(statusRequest()) : takeStatus(*previous);
  };
}

UsbStep TicActuator::takeStatus(const UsbReply& reply) {
  const std::optional<Variables> v = decodeVariables(reply.data);
  if (!v)
    return UsbStep::fail(ActuatorFault::kWrongReply, "an operation state that does not exist");
  const bool backwards = config_.metres_per_unit < 0.0;
  const bool forward_limit = (v->flags & kForwardLimit) != 0;
  const bool reverse_limit = (v->flags & kReverseLimit) != 0;
  ActuatorStatus status;
  status.position_m = config_.origin_m + config_.metres_per_unit * v->position;
  status.velocity_m_per_s = config_.metres_per_unit * v->velocity / kSpeedUnitsPerStep;
  status.state = v->state;
  status.errors = v->errors;
  status.errors_occurred = v->errors_occurred;
  status.energised = (v->flags & kEnergised) != 0;
  status.position_uncertain = (v->flags & kPositionUncertain) != 0;
  status.homing = (v->flags & kHoming) != 0;
  status.at_min = backwards ? forward_limit : reverse_limit;
  status.at_max = backwards ? reverse_limit : forward_limit;
  status.supply_V = v->supply_mV * 1e-3;
  status.command_timeout = config_.command_timeout;  // start() has read it back
  status.taken_at = std::chrono::steady_clock::now();
  status_ = status;
  return UsbStep::done();
}

UsbScript TicActuator::setTarget(double position_m) {
  const std::optional<std::uint32_t> count = microsteps(config_, position_m);
  if (!count) return outOfRange("target [m]", position_m);
  return usbSequence({request32(command::kSetTargetPosition, *count)});
}

UsbScript TicActuator::setVelocity(double velocity_m_per_s) {
  if (!(std::abs(velocity_m_per_s) <= config_.max_speed_m_per_s)) {
    return outOfRange("velocity [m/s]", velocity_m_per_s);
  }
  const auto units = static_cast<std::int32_t>(std::round(speedUnits(config_, velocity_m_per_s)));
  return usbSequence({request32(command::kSetTargetVelocity, static_cast<std::uint32_t>(units))});
}

UsbScript TicActuator::setSpeedLimit(double speed_m_per_s) {
  const double units = std::abs(speedUnits(config_, speed_m_per_s));
  if (!(speed_m_per_s > 0.0 && speed_m_per_s <= config_.max_speed_m_per_s &&
        units >= kSlowestSpeedUnits)) {
    return outOfRange("speed limit [m/s]", speed_m_per_s);
  }
  return usbSequence({request32(command::kSetMaxSpeed, static_cast<std::uint32_t>(units))});
}

UsbScript TicActuator::haltAndHold() { return quick(command::kHaltAndHold); }

UsbScript TicActuator::setPosition(double position_m) {
  const std::optional<std::uint32_t> count = microsteps(config_, position_m);
  if (!count) return outOfRange("position [m]", position_m);
  return usbSequence({request32(command::kHaltAndSetPosition, *count)});
}

// The device remembers a target through an error and would go there once it may: the halt before
// forgets it.
UsbScript TicActuator::energise() {
  return usbSequence(
      {UsbRequest::controlOut(command::kHaltAndHold), UsbRequest::controlOut(command::kEnergise)});
}

UsbScript TicActuator::deenergise() { return quick(command::kDeenergise); }

UsbScript TicActuator::exitSafeStart() {
  return usbSequence({UsbRequest::controlOut(command::kHaltAndHold),
                      UsbRequest::controlOut(command::kExitSafeStart)});
}

UsbScript TicActuator::clearDriverError() { return quick(command::kClearDriverError); }

UsbScript TicActuator::goHome(HomeTowards end) {
  const bool forward = (end == HomeTowards::kMax) == (config_.metres_per_unit > 0.0);
  return usbSequence({UsbRequest::controlOut(command::kGoHome, forward ? 1 : 0)});
}

UsbScript TicActuator::keepAlive() { return quick(command::kResetCommandTimeout); }

}  // namespace tenter
