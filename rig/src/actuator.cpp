// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/actuator.h"

#include <algorithm>

#include "actuator_core.h"

namespace tenter {
namespace {

const ActuatorDriverRow& rowOf(const AxisConfig& config) {
  const ActuatorDriverRow* row = findActuatorDriver(config.driver);
  require(row != nullptr, "axis " + config.name + " has no driver " + config.driver);
  return *row;
}

template <class Script>
AxisOutcome runOne(ActuatorCore& axis, Actuator::Timeout timeout, Script script,
                   OperationKind kind = OperationKind::kPlain) {
  return runTogether({{&axis, std::move(script), kind, nullptr}}, timeout).front();
}

}  // namespace

ActuatorCore::ActuatorCore(AxisConfig axis_config, std::shared_ptr<UsbTransport> usb)
    : config(std::move(axis_config)),
      row(rowOf(config)),
      transport(std::move(usb)),
      driver(row.make(config)) {}

std::shared_ptr<UsbLink> ActuatorCore::link() const {
  const std::lock_guard lock(link_mutex_);
  return link_;
}

void ActuatorCore::setLink(std::shared_ptr<UsbLink> link) {
  const std::lock_guard lock(link_mutex_);
  link_ = std::move(link);
}

void ActuatorCore::preempt() {
  motion_forbidden = true;
  ++halts;
  if (const auto open_link = link()) open_link->cancelAll();
}

Actuator::Actuator(AxisConfig config, std::shared_ptr<UsbTransport> transport)
    : core_(std::make_unique<ActuatorCore>(std::move(config), std::move(transport))) {}
Actuator::~Actuator() = default;
Actuator::Actuator(Actuator&&) noexcept = default;
Actuator& Actuator::operator=(Actuator&&) noexcept = default;

const AxisConfig& Actuator::config() const { return core_->config; }
bool Actuator::connected() const { return core_->link() != nullptr; }

std::optional<ActuatorIdentity> Actuator::identity() const {
  const std::shared_ptr<UsbLink> link = core_->link();
  if (link == nullptr) return {};
  const auto& products = core_->row.products;
  const auto known = std::find_if(products.begin(), products.end(), [&](const UsbProduct& entry) {
    return entry.product == link->product();
  });
  return ActuatorIdentity{std::string(known->name), link->serial()};
}

AxisOutcome Actuator::reconnect(Timeout timeout) {
  AxisOutcome outcome{ActuatorFault::kNone, core_->config.name, ""};
  if (connected()) return outcome;
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  UsbTransport::Wanted wanted{core_->row.vendor, {}, core_->config.serial, core_->config.port};
  for (const UsbProduct& entry : core_->row.products) wanted.products.push_back(entry.product);
  UsbTransport::Connection connection = core_->transport->connect(wanted, deadline);
  if (connection.link == nullptr) {
    outcome.fault = connection.fault;
    outcome.detail = std::move(connection.detail);
    return outcome;
  }
  core_->setLink(std::move(connection.link));
  const auto left =
      std::chrono::duration_cast<Timeout>(deadline - std::chrono::steady_clock::now());
  outcome = runOne(*core_, std::max(left, Timeout{1}), [](ActuatorDriver& d) { return d.start(); });
  if (!outcome.ok()) core_->setLink(nullptr);  // its settings may not be those that safety needs
  return outcome;
}

AxisReading Actuator::status(Timeout timeout) {
  AxisReading reading;
  const auto take = [&](const ActuatorDriver& driver) { reading.status = driver.lastStatus(); };
  const auto script = [](ActuatorDriver& driver) { return driver.readStatus(); };
  reading.outcome =
      runTogether({{core_.get(), script, OperationKind::kPlain, take}}, timeout).front();
  return reading;
}

AxisOutcome Actuator::setTarget(double position_m, Timeout timeout) {
  return runOne(
      *core_, timeout, [=](ActuatorDriver& d) { return d.setTarget(position_m); },
      OperationKind::kMotion);
}

AxisOutcome Actuator::setVelocity(double velocity_m_per_s, Timeout timeout) {
  return runOne(
      *core_, timeout, [=](ActuatorDriver& d) { return d.setVelocity(velocity_m_per_s); },
      OperationKind::kMotion);
}

AxisOutcome Actuator::goHome(HomeTowards end, Timeout timeout) {
  return runOne(
      *core_, timeout, [=](ActuatorDriver& d) { return d.goHome(end); }, OperationKind::kMotion);
}

AxisOutcome Actuator::haltAndHold(Timeout timeout) {
  return runOne(
      *core_, timeout, [](ActuatorDriver& d) { return d.haltAndHold(); }, OperationKind::kHalt);
}

void Actuator::allowMotion() { core_->motion_forbidden = false; }

AxisOutcome Actuator::setSpeedLimit(double speed_m_per_s, Timeout timeout) {
  return runOne(*core_, timeout, [=](ActuatorDriver& d) { return d.setSpeedLimit(speed_m_per_s); });
}

AxisOutcome Actuator::setPosition(double position_m, Timeout timeout) {
  return runOne(*core_, timeout, [=](ActuatorDriver& d) { return d.setPosition(position_m); });
}

AxisOutcome Actuator::energise(Timeout timeout) {
  return runOne(*core_, timeout, [](ActuatorDriver& d) { return d.energise(); });
}

AxisOutcome Actuator::deenergise(Timeout timeout) {
  return runOne(*core_, timeout, [](ActuatorDriver& d) { return d.deenergise(); });
}

AxisOutcome Actuator::exitSafeStart(Timeout timeout) {
  return runOne(*core_, timeout, [](ActuatorDriver& d) { return d.exitSafeStart(); });
}

AxisOutcome Actuator::clearDriverError(Timeout timeout) {
  return runOne(*core_, timeout, [](ActuatorDriver& d) { return d.clearDriverError(); });
}

AxisOutcome Actuator::keepAlive(Timeout timeout) {
  return runOne(*core_, timeout, [](ActuatorDriver& d) { return d.keepAlive(); });
}

}  // namespace tenter
