// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "tenter/rig/tic_protocol.h"
#include "virtual_usb_model.h"

namespace tenter {

/// A Pololu Tic with a stepper: errors, safe start, command time-out, ramps, limit switches and
/// homing as [TicGuide] sec. 5 describes them. Like the device it remembers a target through an
/// error, and settings only take effect upon reinitialise or reset.
class VirtualTic : public VirtualUsbModel {
 public:
  explicit VirtualTic(const VirtualActuatorSpec& spec);

  std::vector<std::uint8_t> descriptors() const override;
  const char* manufacturer() const override { return "Pololu Corporation"; }
  const char* product() const override;
  void powerUp(Time now) override;
  void advanceTo(Time now) override;
  VirtualActuatorState state() const override;
  void setCondition(VirtualFault condition, bool on) override;
  int control(const UsbSetup& setup, std::span<std::uint8_t> data, int& actual) override;
  int bulkOut(std::span<const std::uint8_t> data) override;
  int bulkIn(std::span<std::uint8_t> data, int& actual) override;

 private:
  enum class Planning : std::uint8_t { kOff = 0, kPosition = 1, kVelocity = 2 };
  enum class Homing { kNone, kTowards, kAway };

  int order(std::uint8_t code, std::uint32_t value);
  void loadSettings();
  void reset();
  void goHome(bool forward);
  void judge();  ///< Errors and operation state from what holds now.
  void halt();   ///< At once; steps may be lost.
  double wantedVelocity() const;
  double homingVelocity() const;
  double brakingRate() const;  ///< [microsteps/s^2]
  void move(double dt_s);
  void watchSwitches();
  bool limit(bool forward) const;
  bool timesOut() const;
  std::vector<std::uint8_t> variables() const;
  std::uint32_t stored(int offset, int bytes) const;

  VirtualActuatorSpec spec_;
  Time now_{0}, last_command_{0}, pardon_until_{0}, power_up_{0};
  std::array<std::uint8_t, tic::setting::kCount> settings_{}, active_{};

  bool intentionally_off_ = true, driver_error_ = false, timed_out_ = false, safe_start_ = true;
  bool driver_fails_ = false, low_supply_ = false, kill_switch_ = false;
  bool forward_forced_ = false, reverse_forced_ = false, jammed_ = false, locked_ = false;
  bool uncertain_ = true;
  ActuatorState operation_ = ActuatorState::kDeenergised;
  std::uint32_t errors_ = 0, occurred_ = 0;

  Planning planning_ = Planning::kOff;
  Homing homing_ = Homing::kNone;
  bool homing_forward_ = false;
  std::int32_t target_position_ = 0, target_velocity_ = 0;
  std::uint32_t max_speed_ = 0, starting_speed_ = 0, acceleration_ = 0, deceleration_ = 0;
  double counted_ = 0.0, velocity_ = 0.0, true_position_ = 0.0;
};

}  // namespace tenter
