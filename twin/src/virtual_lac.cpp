// SPDX-License-Identifier: GPL-3.0-or-later
#include "virtual_lac.h"

#include <algorithm>
#include <cerrno>
#include <cmath>

namespace tenter {
namespace {

using namespace lac;  // NOLINT(google-build-using-namespace): this file is the LAC's

constexpr std::uint16_t kFirmware = 0x0100;
constexpr std::size_t kMostAnswers = 16;  // what waits to be fetched

}  // namespace

std::unique_ptr<VirtualUsbModel> makeVirtualLac(const VirtualActuatorSpec& spec) {
  return std::make_unique<VirtualLac>(spec);
}

VirtualLac::VirtualLac(const VirtualActuatorSpec& spec)
    : spec_(spec), position_(spec.start_units), target_(spec.start_units) {}

std::vector<std::uint8_t> VirtualLac::descriptors() const {
  return vendorDescriptors(kVendor, spec_.product, kFirmware, {kEndpointOut, kEndpointIn});
}

void VirtualLac::powerUp(Time now) {
  now_ = now;
  target_ = position_;
  power_ = kFullScale;
  answers_.clear();
}

int VirtualLac::feedback() const {
  return std::clamp(static_cast<int>(std::lround(position_)), 0, kFullScale);
}

void VirtualLac::advanceTo(Time now) {
  const double dt_s = std::chrono::duration<double>(now - now_).count();
  now_ = std::max(now, now_);
  velocity_ = 0.0;
  if (dt_s <= 0.0 || no_power_ || jammed_) return;
  const double goal =
      std::clamp(target_, static_cast<double>(retract_limit_), static_cast<double>(extend_limit_));
  const double speed = spec_.full_speed_units_per_s * power_ / kFullScale;
  const double way = std::clamp(goal - position_, -speed * dt_s, speed * dt_s);
  if ((way > 0.0 && extend_blocked_) || (way < 0.0 && retract_blocked_)) return;
  position_ += way;
  if (position_ != goal) velocity_ = std::copysign(speed, way);
}

VirtualActuatorState VirtualLac::state() const {
  VirtualActuatorState state;
  state.position_units = position_;
  state.counted_units = feedback();
  state.velocity_units_per_s = velocity_;
  state.energised = !no_power_;
  return state;
}

void VirtualLac::setCondition(VirtualFault condition, bool on) {
  switch (condition) {
    case VirtualFault::kKillSwitch:  // it cuts the motor's supply
    case VirtualFault::kUnderVoltage:
    case VirtualFault::kDriverError:
      no_power_ = on;
      break;
    case VirtualFault::kForwardLimit:
      extend_blocked_ = on;
      break;
    case VirtualFault::kReverseLimit:
      retract_blocked_ = on;
      break;
    case VirtualFault::kJammed:
      jammed_ = on;
      break;
    default:
      break;
  }
}

int VirtualLac::control(const UsbSetup&, std::span<std::uint8_t>, int&) { return -EPIPE; }

int VirtualLac::bulkOut(std::span<const std::uint8_t> data) {
  const std::optional<Packet> packet = decode(data);
  if (!packet || answers_.size() >= kMostAnswers) return -EPIPE;
  int answer = packet->value;
  switch (packet->command) {
    case command::kGetFeedback:
      answer = feedback();
      break;
    case command::kSetPosition:
      target_ = packet->value;
      answer = feedback();
      break;
    case command::kSetSpeed:
      power_ = packet->value;
      break;
    case command::kSetRetractLimit:
      retract_limit_ = std::min(packet->value, extend_limit_);
      break;
    case command::kSetExtendLimit:
      extend_limit_ = std::max(packet->value, retract_limit_);
      break;
    case command::kReset:
      powerUp(now_);
      break;
    default:  // accuracy, stall time, gains: they do not matter to this mechanics
      break;
  }
  answers_.push_back(encode({packet->command, answer}));
  return 0;
}

int VirtualLac::bulkIn(std::span<std::uint8_t> data, int& actual) {
  actual = 0;
  if (answers_.empty()) return kNotYet;
  const std::size_t length = std::min(data.size(), answers_.front().size());
  std::copy_n(answers_.front().begin(), length, data.begin());
  answers_.pop_front();
  actual = static_cast<int>(length);
  return 0;
}

}  // namespace tenter
