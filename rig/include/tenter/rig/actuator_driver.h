// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/rig/usb_exchange.h"

namespace tenter {

/// One axis as the rig's configuration describes it. The device counts in its own units
/// (microsteps, or 1/1023 of the feedback); position [m] = origin_m + metres_per_unit * count.
struct AxisConfig {
  std::string name;              ///< For messages, such as "weft-left".
  std::string driver = "tic";    ///< A row of actuatorDrivers().
  std::string serial;            ///< The device's serial number; or, if empty,
  std::string port;              ///< where it is plugged in, such as "1-4.2".
  double metres_per_unit = 0.0;  ///< Negative where the device counts against the axis.
  double origin_m = 0.0;
  double travel_min_m = 0.0, travel_max_m = 0.0;
  double max_speed_m_per_s = 0.0;
  double max_acceleration_m_per_s2 = 0.0;
  /// Silence after which the device itself stops, or by which a target may lead.
  std::chrono::milliseconds command_timeout{200};
  /// An emergency stop is wired to a pin of the device, which must be set to see it.
  bool kill_switch = false;
  double full_speed_m_per_s = 0.0;  ///< LAC only: speed of the unloaded actuator at full power.
};

/// Checks names, ranges and the driver's own wants; error names the axis and the field.
Result<void> checkAxisConfig(const AxisConfig& config);

enum class ActuatorState {
  kReset,
  kDeenergised,
  kSoftError,
  kWaitingForErrLine,
  kStartingUp,
  kNormal
};
std::string_view actuatorStateName(ActuatorState state);

/// Reasons for which a device itself keeps its motor still, as bits.
namespace actuator_error {
inline constexpr std::uint32_t kDeenergised = 1u << 0, kDriver = 1u << 1, kLowSupply = 1u << 2,
                               kKillSwitch = 1u << 3, kInput = 1u << 4, kSerial = 1u << 5,
                               kCommandTimeout = 1u << 6, kSafeStart = 1u << 7, kErrLine = 1u << 8;
}  // namespace actuator_error
std::vector<std::string> actuatorErrorNames(std::uint32_t errors);

/// One complete and decoded answer. What a device cannot tell is absent.
struct ActuatorStatus {
  double position_m = 0.0;
  std::optional<double> velocity_m_per_s;
  ActuatorState state = ActuatorState::kReset;
  std::uint32_t errors = 0;           ///< Bits of actuator_error that hold now.
  std::uint32_t errors_occurred = 0;  ///< Those since the device was last asked to forget them.
  bool energised = false;
  bool position_uncertain = true;  ///< Home before trusting position_m.
  bool homing = false;
  bool at_min = false, at_max = false;  ///< Limit switches, in the axis' own direction.
  std::optional<double> supply_V;
  std::chrono::milliseconds command_timeout{0};    ///< As the device holds it; 0: it has none.
  std::chrono::steady_clock::time_point taken_at;  ///< When the answer was complete.
};

enum class HomeTowards { kMin, kMax };

/// What one kind of controller is told and how its answers read: pure protocol, no input or output.
/// Each call makes the dialogue of one operation; scripts are run one at a time. Positions and
/// speeds in metres of the axis. Orders outside travel or speed give a script that ends with
/// kOutOfRange and sends nothing.
class ActuatorDriver {
 public:
  virtual ~ActuatorDriver() = default;

  /// Puts in force and reads back what safety rests on; ends with kRefused if the device does not
  /// take it. Never energises, never moves.
  virtual UsbScript start() = 0;
  virtual UsbScript readStatus() = 0;
  virtual UsbScript setTarget(double position_m) = 0;
  virtual UsbScript setVelocity(double velocity_m_per_s) = 0;
  virtual UsbScript setSpeedLimit(double speed_m_per_s) = 0;
  /// Stops at once, without a ramp, and holds.
  virtual UsbScript haltAndHold() = 0;
  /// Declares where the axis is; stops it.
  virtual UsbScript setPosition(double position_m) = 0;
  virtual UsbScript energise() = 0;
  virtual UsbScript deenergise() = 0;
  /// Only ever upon the operator's own action.
  virtual UsbScript exitSafeStart() = 0;
  virtual UsbScript clearDriverError() = 0;
  virtual UsbScript goHome(HomeTowards end) = 0;
  /// To be sent more often than command_timeout while the axis is to go on moving.
  virtual UsbScript keepAlive() = 0;

  /// Precondition: a script of readStatus() or start() ended well.
  const ActuatorStatus& lastStatus() const { return status_; }

 protected:
  ActuatorStatus status_;
};

struct UsbProduct {
  std::uint16_t product;
  std::string_view name;
};

/// One kind of controller. To add one: its two files and a row in actuator_drivers.cpp.
struct ActuatorDriverRow {
  std::string_view id;
  std::uint16_t vendor;
  std::span<const UsbProduct> products;
  Result<void> (*check)(const AxisConfig& config);
  std::unique_ptr<ActuatorDriver> (*make)(const AxisConfig& config);
  bool sees_kill_switch;  ///< It has an input for one: the default of AxisConfig::kill_switch.
};

std::span<const ActuatorDriverRow> actuatorDrivers();
const ActuatorDriverRow* findActuatorDriver(std::string_view id);

}  // namespace tenter
