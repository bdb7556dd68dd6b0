// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "tenter/rig/actuator_bank.h"
#include "tenter/twin/virtual_usb.h"

namespace tenter::device_test {

inline constexpr int kAxes = 8;
inline constexpr double kMetresPerMicrostep = 1e-6;
inline constexpr double kMetresPerCount = 1e-4;  // a LAC with 102 mm of stroke
inline constexpr std::chrono::milliseconds kConnectTimeout{1000};
/// Of orders whose time is not what a test is about: a busy machine may answer late.
inline constexpr std::chrono::milliseconds kPatience{500};

/// Tics with serial numbers 00000001 and on, one of each model in turn.
std::vector<VirtualActuatorSpec> ticSpecs(int count);
std::vector<AxisConfig> ticAxes(int count);
VirtualActuatorSpec lacSpec();
AxisConfig lacAxis();

/// A virtual bus and a connected bank on it. Throws what goes wrong.
struct VirtualRig {
  VirtualRig(std::vector<VirtualActuatorSpec> specs, std::vector<AxisConfig> axes);
  explicit VirtualRig(int tics) : VirtualRig(ticSpecs(tics), ticAxes(tics)) {}

  /// Energises every axis and leaves safe start, as an operator would.
  void release();
  /// Until an error takes safe start back at once: for 200 ms after it was left it does not.
  void settle();

  std::unique_ptr<VirtualUsb> usb;
  ActuatorBank bank;
};

void sleepFor(double seconds);
double secondsSince(std::chrono::steady_clock::time_point start);

}  // namespace tenter::device_test
