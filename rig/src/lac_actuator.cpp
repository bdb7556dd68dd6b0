// SPDX-License-Identifier: GPL-3.0-or-later
#include "lac_actuator.h"

#include <algorithm>
#include <cmath>

namespace tenter {
namespace {

using namespace lac;  // NOLINT(google-build-using-namespace): this file is the LAC's

/// Packets one after the other, each answered. `next` is given the value of the last answer, null
/// at first, and says what to send; nothing ends the operation.
using LacDialogue = std::function<std::optional<Packet>(const int* answer)>;

/// While `unfinished`, an earlier operation may have left its answer in the pipe, which could pass
/// for the one awaited: then it begins by throwing away what is there.
UsbScript converse(bool& unfinished, LacDialogue next) {
  enum class Wait { kFirst, kDrained, kSent, kAnswer };
  return [&unfinished, next = std::move(next), wait = Wait::kFirst,
          sent = Packet{}](const UsbReply* previous) mutable {
    const auto send = [&](const int* answer) {
      const std::optional<Packet> packet = next(answer);
      unfinished = packet.has_value();
      if (!packet) return UsbStep::done();
      sent = *packet;
      wait = Wait::kSent;
      const auto bytes = encode(sent);
      return UsbStep::send(UsbRequest::bulkOut(kEndpointOut, {bytes.begin(), bytes.end()}));
    };
    switch (wait) {
      case Wait::kFirst:
        if (!unfinished) return send(nullptr);
        wait = Wait::kDrained;
        return UsbStep::send(UsbRequest::drain(kEndpointIn, kPacketLength));
      case Wait::kDrained:
        if (!previous->data.empty()) {
          return UsbStep::send(UsbRequest::drain(kEndpointIn, kPacketLength));
        }
        return send(nullptr);
      case Wait::kSent:
        wait = Wait::kAnswer;
        return UsbStep::send(UsbRequest::bulkIn(kEndpointIn, kPacketLength));
      case Wait::kAnswer:
        break;
    }
    const std::optional<Packet> answer = decode(previous->data);
    if (!answer || answer->command != sent.command) {
      return UsbStep::fail(ActuatorFault::kWrongReply, "an answer to another packet");
    }
    return send(&answer->value);
  };
}

UsbScript nothing() { return usbSequence({}); }

/// Power for a speed, or nothing if the actuator cannot go so fast or so slowly.
std::optional<int> powerFor(const AxisConfig& config, double speed_m_per_s) {
  if (!(speed_m_per_s > 0.0 && speed_m_per_s <= config.max_speed_m_per_s)) return {};
  const double power = std::floor(kFullScale * speed_m_per_s / config.full_speed_m_per_s);
  if (!(power >= 1.0 && power <= kFullScale)) return {};
  return static_cast<int>(power);
}

/// How many counts a target may lie ahead at this speed.
int leadCounts(const AxisConfig& config, double speed_m_per_s) {
  const double lead_s = std::chrono::duration<double>(config.command_timeout).count();
  return static_cast<int>(std::floor(speed_m_per_s * lead_s / std::abs(config.metres_per_unit)));
}

/// Its controller stands still within a few counts of the target.
constexpr int kArrivedCounts = 8;

}  // namespace

Result<void> checkLacConfig(const AxisConfig& config) {
  const std::string place = "axis " + config.name + ": ";
  if (!(config.full_speed_m_per_s > 0.0)) {
    return badInput("", place + "full_speed_m_per_s",
                    "a LAC needs the actuator's speed at full power",
                    "take the no-load speed of its data sheet");
  }
  if (!powerFor(config, config.max_speed_m_per_s)) {
    return badInput("", place + "max_speed_m_per_s", "the actuator's full speed is not above it");
  }
  if (config.kill_switch) {
    return badInput("", place + "kill_switch", "a LAC has no input for one and cannot report it");
  }
  if (leadCounts(config, config.max_speed_m_per_s) < 1) {
    return badInput("", place + "max_speed_m_per_s",
                    "within the command time-out it does not reach the next count of the feedback",
                    "raise the speed or use an actuator of shorter stroke");
  }
  for (const double end_m : {config.travel_min_m, config.travel_max_m}) {
    const double count = (end_m - config.origin_m) / config.metres_per_unit;
    if (!(std::round(count) >= 0.0 && std::round(count) <= kFullScale)) {
      return badInput("", place + "travel", "its ends lie outside the LAC's 0 to 1023 counts");
    }
  }
  return {};
}

std::optional<int> LacActuator::countOf(double position_m) const {
  if (!(position_m >= config_.travel_min_m && position_m <= config_.travel_max_m)) return {};
  return static_cast<int>(std::round((position_m - config_.origin_m) / config_.metres_per_unit));
}

void LacActuator::takePosition(int count) {
  ActuatorStatus status;
  status.position_m = config_.origin_m + config_.metres_per_unit * count;
  status.state = ActuatorState::kNormal;
  status.energised = true;
  status.position_uncertain = false;
  if (home_ && std::abs(count - *home_) <= kArrivedCounts) home_.reset();
  status.homing = home_.has_value();
  status.at_min = status.position_m <= config_.travel_min_m;
  status.at_max = status.position_m >= config_.travel_max_m;
  status.taken_at = std::chrono::steady_clock::now();
  status_ = status;
}

UsbScript LacActuator::start() {
  home_.reset();
  speed_m_per_s_ = config_.max_speed_m_per_s;
  const int power = powerFor(config_, speed_m_per_s_).value_or(0);
  enum class Step { kManual, kFeedback, kHold, kSpeed, kEnd };
  return converse(
      unfinished_,
      [this, power, step = Step::kManual](const int* answer) mutable -> std::optional<Packet> {
        switch (step) {
          case Step::kManual:  // its potentiometers would drive it otherwise
            step = Step::kFeedback;
            return Packet{command::kDisableManual, 0};
          case Step::kFeedback:
            step = Step::kHold;
            return Packet{command::kGetFeedback, 0};
          case Step::kHold:
            step = Step::kSpeed;
            goal_.reset();
            return Packet{command::kSetPosition, *answer};
          case Step::kSpeed:
            step = Step::kEnd;
            takePosition(*answer);
            return Packet{command::kSetSpeed, power};
          case Step::kEnd:
            break;
        }
        return {};
      });
}

UsbScript LacActuator::readStatus() {
  return converse(unfinished_, [this](const int* answer) -> std::optional<Packet> {
    if (answer == nullptr) return Packet{command::kGetFeedback, 0};
    takePosition(*answer);
    return {};
  });
}

UsbScript LacActuator::follow() {
  if (!goal_) return nothing();
  enum class Step { kFeedback, kTarget, kEnd };
  return converse(
      unfinished_,
      [this, step = Step::kFeedback](const int* answer) mutable -> std::optional<Packet> {
        switch (step) {
          case Step::kFeedback:
            step = Step::kTarget;
            return Packet{command::kGetFeedback, 0};
          case Step::kTarget: {
            step = Step::kEnd;
            const int lead = leadCounts(config_, speed_m_per_s_);
            const int target = std::clamp(*goal_, *answer - lead, *answer + lead);
            return Packet{command::kSetPosition, std::clamp(target, 0, kFullScale)};
          }
          case Step::kEnd:
            takePosition(*answer);
            break;
        }
        return {};
      });
}

UsbScript LacActuator::setTarget(double position_m) {
  const std::optional<int> count = countOf(position_m);
  if (!count) {
    return usbFailure(ActuatorFault::kOutOfRange, "target [m] " + std::to_string(position_m));
  }
  goal_ = count;
  home_.reset();
  return follow();
}

UsbScript LacActuator::withSpeed(double speed_m_per_s, std::optional<int> goal) {
  const std::optional<int> power = powerFor(config_, speed_m_per_s);
  if (!power || leadCounts(config_, speed_m_per_s) < 1) {
    return usbFailure(ActuatorFault::kOutOfRange, "speed [m/s] " + std::to_string(speed_m_per_s));
  }
  return converse(unfinished_,
                  [this, speed_m_per_s, goal, power](const int* answer) -> std::optional<Packet> {
                    if (answer == nullptr) return Packet{command::kSetSpeed, *power};
                    speed_m_per_s_ = speed_m_per_s;
                    if (!goal) return {};
                    goal_ = goal;  // the next keepAlive sets off
                    home_.reset();
                    return {};
                  });
}

UsbScript LacActuator::setVelocity(double velocity_m_per_s) {
  if (velocity_m_per_s == 0.0) return haltAndHold();
  const double end_m = velocity_m_per_s > 0.0 ? config_.travel_max_m : config_.travel_min_m;
  return withSpeed(std::abs(velocity_m_per_s), countOf(end_m));
}

UsbScript LacActuator::setSpeedLimit(double speed_m_per_s) { return withSpeed(speed_m_per_s, {}); }

UsbScript LacActuator::haltAndHold() {
  goal_.reset();
  home_.reset();
  enum class Step { kFeedback, kHold, kEnd };
  return converse(
      unfinished_,
      [this, step = Step::kFeedback](const int* answer) mutable -> std::optional<Packet> {
        switch (step) {
          case Step::kFeedback:
            step = Step::kHold;
            return Packet{command::kGetFeedback, 0};
          case Step::kHold:
            step = Step::kEnd;
            return Packet{command::kSetPosition, *answer};
          case Step::kEnd:
            takePosition(*answer);
            break;
        }
        return {};
      });
}

UsbScript LacActuator::setPosition(double) {
  return usbFailure(ActuatorFault::kOutOfRange, "the feedback is absolute and cannot be redefined");
}

UsbScript LacActuator::energise() { return nothing(); }
UsbScript LacActuator::deenergise() { return haltAndHold(); }
UsbScript LacActuator::exitSafeStart() { return nothing(); }
UsbScript LacActuator::clearDriverError() { return nothing(); }

UsbScript LacActuator::goHome(HomeTowards end) {
  UsbScript script =
      setTarget(end == HomeTowards::kMax ? config_.travel_max_m : config_.travel_min_m);
  home_ = goal_;
  return script;
}

UsbScript LacActuator::keepAlive() { return follow(); }

}  // namespace tenter
