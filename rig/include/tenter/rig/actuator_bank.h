// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/rig/actuator.h"

namespace tenter {

/// All axes of a rig. What is asked of all of them is in flight on all of them at the same time,
/// so a mute device delays none of the others; answers are in the order of the axes. From any
/// thread; haltAll() cuts short what is under way. No call lasts longer than twice its timeout.
class ActuatorBank {
 public:
  using Timeout = Actuator::Timeout;

  /// Checks every configuration and starts USB. Devices are taken up by reconnectMissing(). Error:
  /// a wrong configuration, the same name or device twice, no USB.
  static Result<ActuatorBank> create(std::vector<AxisConfig> axes);
  ~ActuatorBank();
  ActuatorBank(ActuatorBank&&) noexcept;
  ActuatorBank& operator=(ActuatorBank&&) noexcept;

  int size() const { return static_cast<int>(axes_.size()); }
  Actuator& axis(int index) { return axes_.at(static_cast<std::size_t>(index)); }

  /// Takes up every device that is not connected, one after the other, each within `timeout`.
  std::vector<AxisOutcome> reconnectMissing(Timeout timeout);
  /// Grows whenever something is plugged in anywhere: the time to call reconnectMissing().
  unsigned arrivals() const;

  std::vector<AxisReading> pollAll(Timeout timeout = Actuator::kDefaultTimeout);
  std::vector<AxisOutcome> keepAliveAll(Timeout timeout = Actuator::kDefaultTimeout);
  /// An axis without a target is kept alive instead. Precondition: one entry an axis.
  std::vector<AxisOutcome> setTargets(const std::vector<std::optional<double>>& positions_m,
                                      Timeout timeout = Actuator::kDefaultTimeout);
  /// An axis without a speed is not asked. Precondition: one entry an axis.
  std::vector<AxisOutcome> setSpeedLimits(const std::vector<std::optional<double>>& speeds_m_per_s,
                                          Timeout timeout = Actuator::kDefaultTimeout);
  std::vector<AxisOutcome> haltAll(Timeout timeout = Actuator::kDefaultTimeout);
  void allowMotion();
  std::vector<AxisOutcome> deenergiseAll(Timeout timeout = Actuator::kDefaultTimeout);

 private:
  ActuatorBank(std::shared_ptr<UsbTransport> transport, std::vector<Actuator> axes);
  std::vector<ActuatorCore*> cores() const;

  std::shared_ptr<UsbTransport> transport_;
  std::vector<Actuator> axes_;
};

}  // namespace tenter
