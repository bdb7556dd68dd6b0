// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "virtual_tic.h"

namespace tenter {
namespace {

using namespace tic;  // NOLINT(google-build-using-namespace): this file is the Tic's
using namespace std::chrono_literals;

constexpr std::chrono::nanoseconds kStep = 200us;
constexpr double kLastStep = 1.5;  // microsteps from which the motor stops dead on its target

}  // namespace

void VirtualTic::halt() {
  if (velocity_ != 0.0) uncertain_ = true;
  velocity_ = 0.0;
}

bool VirtualTic::limit(bool forward) const {
  if (forward) {
    return forward_forced_ ||
           (spec_.forward_switch_units && true_position_ >= *spec_.forward_switch_units);
  }
  return reverse_forced_ ||
         (spec_.reverse_switch_units && true_position_ <= *spec_.reverse_switch_units);
}

bool VirtualTic::timesOut() const { return stored(setting::kCommandTimeout_ms, 2) != 0; }

void VirtualTic::advanceTo(Time now) {
  while (now_ < now) {
    const Time deadline =
        last_command_ + std::chrono::milliseconds(stored(setting::kCommandTimeout_ms, 2));
    const bool at_rest = velocity_ == 0.0 && wantedVelocity() == 0.0;
    Time end = at_rest ? now : std::min(now, now_ + kStep);
    if (timesOut() && !timed_out_ && deadline > now_) end = std::min(end, deadline);
    move(std::chrono::duration<double>(end - now_).count());
    now_ = end;
    if (timesOut() && now_ >= deadline) timed_out_ = true;
    watchSwitches();
    judge();
  }
}

double VirtualTic::brakingRate() const {
  return (deceleration_ != 0 ? deceleration_ : acceleration_) / kAccelerationUnitsPerStep;
}

double VirtualTic::homingVelocity() const {
  const int offset = homing_ == Homing::kTowards ? setting::kHomingTowards : setting::kHomingAway;
  const double speed = stored(offset, 4) / kSpeedUnitsPerStep;
  return homing_forward_ == (homing_ == Homing::kTowards) ? speed : -speed;
}

double VirtualTic::wantedVelocity() const {
  if (operation_ != ActuatorState::kNormal) return 0.0;
  double wanted = 0.0;
  if (homing_ != Homing::kNone) {
    wanted = homingVelocity();
  } else if (planning_ == Planning::kVelocity) {
    wanted = target_velocity_ / kSpeedUnitsPerStep;
  } else if (planning_ == Planning::kPosition) {
    const double way = target_position_ - counted_;
    wanted = std::copysign(std::sqrt(2.0 * brakingRate() * std::abs(way)), way);
    if (way == 0.0) wanted = 0.0;
  }
  const double fastest = max_speed_ / kSpeedUnitsPerStep;
  wanted = std::clamp(wanted, -fastest, fastest);
  return wanted != 0.0 && limit(wanted > 0.0) ? 0.0 : wanted;
}

void VirtualTic::move(double dt_s) {
  const double wanted = wantedVelocity();
  const bool braking = std::abs(wanted) < std::abs(velocity_) || wanted * velocity_ < 0.0;
  const double change =
      (braking ? brakingRate() : acceleration_ / kAccelerationUnitsPerStep) * dt_s;
  velocity_ += std::clamp(wanted - velocity_, -change, change);
  double way = velocity_ * dt_s;
  if (planning_ == Planning::kPosition && operation_ == ActuatorState::kNormal) {
    const double left = target_position_ - counted_;
    const bool reaches = left * way >= 0.0 && std::abs(way) >= std::abs(left);
    if (reaches && std::abs(velocity_) <= std::sqrt(2.0 * kLastStep * brakingRate()) + change) {
      way = left;
      velocity_ = 0.0;
    }
  }
  counted_ += way;
  if (!jammed_) true_position_ += way;
}

void VirtualTic::watchSwitches() {
  if (velocity_ != 0.0 && limit(velocity_ > 0.0)) halt();
  if (homing_ == Homing::kTowards && limit(homing_forward_)) {
    homing_ = Homing::kAway;
  } else if (homing_ == Homing::kAway && !limit(homing_forward_)) {
    homing_ = Homing::kNone;
    velocity_ = 0.0;
    counted_ = 0.0;
    uncertain_ = false;
  }
}

}  // namespace tenter
