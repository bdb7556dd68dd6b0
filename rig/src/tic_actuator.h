// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/rig/actuator_driver.h"
#include "tenter/rig/tic_protocol.h"

namespace tenter {

/// Whether speed, acceleration and travel can be said in the Tic's units.
Result<void> checkTicConfig(const AxisConfig& config);

/// Pololu Tic in its serial control mode. The device stops by itself (its command time-out, with a
/// halt and not a ramp) when setTarget, setVelocity, haltAndHold or keepAlive stay away.
class TicActuator : public ActuatorDriver {
 public:
  explicit TicActuator(const AxisConfig& config) : config_(config) {}

  UsbScript start() override;
  UsbScript readStatus() override;
  UsbScript setTarget(double position_m) override;
  UsbScript setVelocity(double velocity_m_per_s) override;
  UsbScript setSpeedLimit(double speed_m_per_s) override;
  UsbScript haltAndHold() override;
  UsbScript setPosition(double position_m) override;
  UsbScript energise() override;
  UsbScript deenergise() override;
  UsbScript exitSafeStart() override;
  UsbScript clearDriverError() override;
  UsbScript goHome(HomeTowards end) override;
  UsbScript keepAlive() override;

 private:
  UsbStep takeStatus(const UsbReply& reply);
  UsbStep checkSettings(const UsbReply& reply) const;

  AxisConfig config_;
};

}  // namespace tenter
