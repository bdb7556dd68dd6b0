// SPDX-License-Identifier: GPL-3.0-or-later
#include "virtual_rig.h"

#include <stdexcept>
#include <thread>

#include "tenter/rig/tic_protocol.h"

namespace tenter::device_test {
namespace {

template <class T>
T valueOf(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message());
  return *std::move(result);
}

void check(const AxisOutcome& outcome) {
  if (!outcome.ok()) throw std::runtime_error(outcome.error().message());
}

std::string serialOf(int index) { return "0000000" + std::to_string(index + 1); }

}  // namespace

std::vector<VirtualActuatorSpec> ticSpecs(int count) {
  std::vector<VirtualActuatorSpec> specs;
  for (int i = 0; i < count; ++i) {
    VirtualActuatorSpec spec;
    spec.product = tic::kProducts[static_cast<std::size_t>(i) % tic::kProducts.size()].product;
    spec.serial = serialOf(i);
    spec.start_units = 1000.0;
    spec.reverse_switch_units = 0.0;
    spec.forward_switch_units = 90'000.0;
    specs.push_back(spec);
  }
  return specs;
}

std::vector<AxisConfig> ticAxes(int count) {
  std::vector<AxisConfig> axes;
  for (int i = 0; i < count; ++i) {
    AxisConfig axis;
    axis.name = "axis-" + std::to_string(i);
    axis.serial = serialOf(i);
    axis.metres_per_unit = kMetresPerMicrostep;
    axis.travel_min_m = -0.1;
    axis.travel_max_m = 0.1;
    axis.max_speed_m_per_s = 0.005;
    axis.max_acceleration_m_per_s2 = 0.1;
    axes.push_back(axis);
  }
  return axes;
}

VirtualActuatorSpec lacSpec() {
  VirtualActuatorSpec spec;
  spec.driver = "lac";
  spec.serial = "LAC-7";
  spec.start_units = 300.0;
  spec.full_speed_units_per_s = 200.0;
  return spec;
}

AxisConfig lacAxis() {
  AxisConfig axis;
  axis.name = "lifter";
  axis.driver = "lac";
  axis.serial = "LAC-7";
  axis.metres_per_unit = kMetresPerCount;
  axis.travel_min_m = 0.0;
  axis.travel_max_m = 0.1;
  axis.max_speed_m_per_s = 0.01;
  axis.full_speed_m_per_s = 0.02;
  return axis;
}

VirtualRig::VirtualRig(std::vector<VirtualActuatorSpec> specs, std::vector<AxisConfig> axes)
    : usb(valueOf(VirtualUsb::create(std::move(specs)))),
      bank(valueOf(ActuatorBank::create(std::move(axes)))) {
  for (const AxisOutcome& outcome : bank.reconnectMissing(kConnectTimeout)) check(outcome);
}

void VirtualRig::release() {
  for (int i = 0; i < bank.size(); ++i) {
    check(bank.axis(i).energise(kPatience));
    check(bank.axis(i).exitSafeStart(kPatience));
  }
}

void VirtualRig::settle() {
  const auto start = std::chrono::steady_clock::now();
  while (secondsSince(start) < 0.21) {
    bank.keepAliveAll(kPatience);
    sleepFor(0.02);
  }
}

void sleepFor(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace tenter::device_test
