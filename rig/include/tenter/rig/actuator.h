// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tenter/rig/actuator_driver.h"

namespace tenter {

class ActuatorCore;
class UsbTransport;

/// Which device serves an axis.
struct ActuatorIdentity {
  std::string model;   ///< Such as "Tic T249".
  std::string serial;  ///< Empty if the device has none.
};

/// A reading or the fault that stands in its place.
struct AxisReading {
  AxisOutcome outcome;
  std::optional<ActuatorStatus> status;  ///< There exactly if outcome.ok().
};

/// One axis: its configuration, its driver and, while it is plugged in, its device. From any
/// thread: operations of one axis run one after the other, but haltAndHold() cuts short what is
/// under way.
///
/// No call lasts longer than twice its `timeout`. After haltAndHold(), orders that move are refused
/// with kHalted until allowMotion(), so that a motion loop that has not heard of the halt cannot
/// undo it. A device that goes is let go of; reconnect() takes it up again.
class Actuator {
 public:
  using Timeout = std::chrono::milliseconds;
  static constexpr Timeout kDefaultTimeout{50};

  /// Does not touch the device yet; call reconnect(). Precondition: checkAxisConfig(config).
  Actuator(AxisConfig config, std::shared_ptr<UsbTransport> transport);
  ~Actuator();
  Actuator(Actuator&&) noexcept;
  Actuator& operator=(Actuator&&) noexcept;

  const AxisConfig& config() const;
  bool connected() const;
  std::optional<ActuatorIdentity> identity() const;  ///< Nothing unless connected.

  /// Finds the device, opens it, puts its settings in force and reads them back. Never energises
  /// and never moves. Does nothing if connected.
  AxisOutcome reconnect(Timeout timeout);

  AxisReading status(Timeout timeout = kDefaultTimeout);
  AxisOutcome setTarget(double position_m, Timeout timeout = kDefaultTimeout);
  AxisOutcome setVelocity(double velocity_m_per_s, Timeout timeout = kDefaultTimeout);
  AxisOutcome goHome(HomeTowards end, Timeout timeout = kDefaultTimeout);
  AxisOutcome setSpeedLimit(double speed_m_per_s, Timeout timeout = kDefaultTimeout);
  /// Stops abruptly; a Tic's position is uncertain afterwards.
  AxisOutcome haltAndHold(Timeout timeout = kDefaultTimeout);
  void allowMotion();
  AxisOutcome setPosition(double position_m, Timeout timeout = kDefaultTimeout);
  AxisOutcome energise(Timeout timeout = kDefaultTimeout);
  AxisOutcome deenergise(Timeout timeout = kDefaultTimeout);
  AxisOutcome exitSafeStart(Timeout timeout = kDefaultTimeout);
  AxisOutcome clearDriverError(Timeout timeout = kDefaultTimeout);
  AxisOutcome keepAlive(Timeout timeout = kDefaultTimeout);

 private:
  friend class ActuatorBank;
  std::unique_ptr<ActuatorCore> core_;
};

}  // namespace tenter
