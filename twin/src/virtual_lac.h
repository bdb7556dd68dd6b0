// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <deque>

#include "tenter/rig/lac_protocol.h"
#include "virtual_usb_model.h"

namespace tenter {

/// An Actuonix LAC with a linear actuator: goes to the last position it was told, whatever becomes
/// of the host.
class VirtualLac : public VirtualUsbModel {
 public:
  explicit VirtualLac(const VirtualActuatorSpec& spec);

  std::vector<std::uint8_t> descriptors() const override;
  const char* manufacturer() const override { return "Actuonix Motion Devices"; }
  const char* product() const override { return lac::kProducts[0].name.data(); }
  void powerUp(Time now) override;
  void advanceTo(Time now) override;
  VirtualActuatorState state() const override;
  void setCondition(VirtualFault condition, bool on) override;
  int control(const UsbSetup& setup, std::span<std::uint8_t> data, int& actual) override;
  int bulkOut(std::span<const std::uint8_t> data) override;
  int bulkIn(std::span<std::uint8_t> data, int& actual) override;

 private:
  int feedback() const;

  VirtualActuatorSpec spec_;
  Time now_{0};
  double position_, target_, velocity_ = 0.0;
  int power_ = lac::kFullScale, retract_limit_ = 0, extend_limit_ = lac::kFullScale;
  bool no_power_ = false, jammed_ = false, retract_blocked_ = false, extend_blocked_ = false;
  std::deque<std::array<std::uint8_t, lac::kPacketLength>> answers_;
};

}  // namespace tenter
