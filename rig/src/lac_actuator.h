// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/rig/actuator_driver.h"
#include "tenter/rig/lac_protocol.h"

namespace tenter {

/// Whether the LAC can follow at the configured speed, and travel lies on its scale.
Result<void> checkLacConfig(const AxisConfig& config);

/// Actuonix LAC. It has no time-out of its own, so it is never told its goal: each setTarget and
/// keepAlive reads where it is and moves its target at most command_timeout of travel ahead.
class LacActuator : public ActuatorDriver {
 public:
  explicit LacActuator(const AxisConfig& config)
      : config_(config), speed_m_per_s_(config.max_speed_m_per_s) {}

  UsbScript start() override;
  UsbScript readStatus() override;
  UsbScript setTarget(double position_m) override;
  UsbScript setVelocity(double velocity_m_per_s) override;
  UsbScript setSpeedLimit(double speed_m_per_s) override;
  UsbScript haltAndHold() override;
  UsbScript setPosition(double position_m) override;
  UsbScript energise() override;               ///< It always is: does nothing.
  UsbScript deenergise() override;             ///< Its screw holds without current: halts.
  UsbScript exitSafeStart() override;          ///< It has none: does nothing.
  UsbScript clearDriverError() override;       ///< It reports none: does nothing.
  UsbScript goHome(HomeTowards end) override;  ///< Its feedback is absolute: goes to that end.
  UsbScript keepAlive() override;

 private:
  std::optional<int> countOf(double position_m) const;
  void takePosition(int count);
  UsbScript follow();
  UsbScript withSpeed(double speed_m_per_s, std::optional<int> goal);

  AxisConfig config_;
  double speed_m_per_s_;
  bool unfinished_ = true;   ///< An answer may still be in the pipe.
  std::optional<int> goal_;  ///< Where it is to go; nothing while it holds.
  std::optional<int> home_;  ///< The end that it was sent home to, until it is there.
};

}  // namespace tenter
