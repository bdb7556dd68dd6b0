// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/actuator_bank.h"

#include <set>

#include "actuator_core.h"

namespace tenter {
namespace {

using Cores = std::vector<ActuatorCore*>;

template <class Script>
std::vector<AxisOutcome> runAll(const Cores& axes, Actuator::Timeout timeout, Script script,
                                OperationKind kind = OperationKind::kPlain) {
  std::vector<AxisTask> tasks;
  for (ActuatorCore* axis : axes) tasks.push_back({axis, script, kind, nullptr});
  return runTogether(tasks, timeout);
}

Result<void> checkAll(const std::vector<AxisConfig>& axes) {
  std::set<std::string> names, devices;
  for (const AxisConfig& axis : axes) {
    if (Result<void> checked = checkAxisConfig(axis); !checked) return checked.error();
    if (!names.insert(axis.name).second) {
      return badInput("", "axis " + axis.name, "two axes have this name");
    }
    const std::string device = axis.serial.empty() ? "port " + axis.port : "serial " + axis.serial;
    if (!devices.insert(axis.driver + " " + device).second) {
      return badInput("", "axis " + axis.name, "another axis has the same device, " + device);
    }
  }
  return {};
}

}  // namespace

Result<ActuatorBank> ActuatorBank::create(std::vector<AxisConfig> axes) {
  if (Result<void> checked = checkAll(axes); !checked) return checked.error();
  Result<std::shared_ptr<UsbTransport>> transport = UsbTransport::open();
  if (!transport) return transport.error();
  std::vector<Actuator> actuators;
  actuators.reserve(axes.size());
  for (AxisConfig& axis : axes) actuators.emplace_back(std::move(axis), *transport);
  return ActuatorBank(*transport, std::move(actuators));
}

ActuatorBank::ActuatorBank(std::shared_ptr<UsbTransport> transport, std::vector<Actuator> axes)
    : transport_(std::move(transport)), axes_(std::move(axes)) {}
ActuatorBank::~ActuatorBank() = default;
ActuatorBank::ActuatorBank(ActuatorBank&&) noexcept = default;
ActuatorBank& ActuatorBank::operator=(ActuatorBank&&) noexcept = default;

Cores ActuatorBank::cores() const {
  Cores all;
  for (const Actuator& axis : axes_) all.push_back(axis.core_.get());
  return all;
}

std::vector<AxisOutcome> ActuatorBank::reconnectMissing(Timeout timeout) {
  std::vector<AxisOutcome> outcomes;
  outcomes.reserve(axes_.size());
  for (Actuator& axis : axes_) outcomes.push_back(axis.reconnect(timeout));
  return outcomes;
}

unsigned ActuatorBank::arrivals() const { return transport_->arrivals(); }

std::vector<AxisReading> ActuatorBank::pollAll(Timeout timeout) {
  std::vector<AxisReading> readings(axes_.size());
  std::vector<AxisTask> tasks;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    tasks.push_back({axes_[i].core_.get(),
                     [](ActuatorDriver& driver) { return driver.readStatus(); },
                     OperationKind::kPlain,
                     [reading = &readings[i]](const ActuatorDriver& driver) {
                       reading->status = driver.lastStatus();
                     }});
  }
  std::vector<AxisOutcome> outcomes = runTogether(tasks, timeout);
  for (std::size_t i = 0; i < outcomes.size(); ++i) readings[i].outcome = std::move(outcomes[i]);
  return readings;
}

std::vector<AxisOutcome> ActuatorBank::keepAliveAll(Timeout timeout) {
  return runAll(cores(), timeout, [](ActuatorDriver& driver) { return driver.keepAlive(); });
}

std::vector<AxisOutcome> ActuatorBank::setTargets(
    const std::vector<std::optional<double>>& positions_m, Timeout timeout) {
  require(positions_m.size() == axes_.size(), "one target an axis");
  std::vector<AxisTask> tasks;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const std::optional<double> position_m = positions_m[i];
    tasks.push_back({axes_[i].core_.get(),
                     [position_m](ActuatorDriver& driver) {
                       return position_m ? driver.setTarget(*position_m) : driver.keepAlive();
                     },
                     position_m ? OperationKind::kMotion : OperationKind::kPlain, nullptr});
  }
  return runTogether(tasks, timeout);
}

std::vector<AxisOutcome> ActuatorBank::setSpeedLimits(
    const std::vector<std::optional<double>>& speeds_m_per_s, Timeout timeout) {
  require(speeds_m_per_s.size() == axes_.size(), "one speed an axis");
  std::vector<AxisTask> tasks;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (!speeds_m_per_s[i]) continue;
    tasks.push_back({axes_[i].core_.get(),
                     [speed = *speeds_m_per_s[i]](ActuatorDriver& driver) {
                       return driver.setSpeedLimit(speed);
                     },
                     OperationKind::kPlain, nullptr});
  }
  return runTogether(tasks, timeout);
}

std::vector<AxisOutcome> ActuatorBank::haltAll(Timeout timeout) {
  return runAll(
      cores(), timeout, [](ActuatorDriver& driver) { return driver.haltAndHold(); },
      OperationKind::kHalt);
}

void ActuatorBank::allowMotion() {
  for (Actuator& axis : axes_) axis.allowMotion();
}

std::vector<AxisOutcome> ActuatorBank::deenergiseAll(Timeout timeout) {
  return runAll(cores(), timeout, [](ActuatorDriver& driver) { return driver.deenergise(); });
}

}  // namespace tenter
