// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <thread>

#include "tenter/rig/tic_protocol.h"
#include "virtual_rig.h"

namespace tenter::device_test {
namespace {

constexpr Actuator::Timeout kTimeout{60};
constexpr double kTimeout_s = 0.060;
// An unplugging takes the virtual bus as long as its machine lets it; the answer must not outwait
// it.
constexpr Actuator::Timeout kUnplugTimeout{1000};

Actuator::Timeout timeoutFor(VirtualFault fault) {
  return fault == VirtualFault::kUnplugInTransfer ? kUnplugTimeout : kTimeout;
}

struct NamedFault {
  VirtualFault injected;
  ActuatorFault seen;
  const char* name;
};

constexpr NamedFault kTransferFaults[] = {
    {VirtualFault::kStall, ActuatorFault::kStall, "stall"},
    {VirtualFault::kProtocolError, ActuatorFault::kProtocolError, "protocol-error"},
    {VirtualFault::kShortReply, ActuatorFault::kShortReply, "short-reply"},
    {VirtualFault::kMute, ActuatorFault::kTimeout, "timeout"},
    {VirtualFault::kUnplugInTransfer, ActuatorFault::kUnplugged, "unplugged"},
};

TEST(ActuatorFaults, EachIsNamedWithinItsTimeAndNeverGivesAReading) {
  for (const NamedFault& fault : kTransferFaults) {
    SCOPED_TRACE(fault.name);
    // One at a time: there is one virtual bus a process.
    VirtualRig rig(2);
    rig.usb->inject(0, fault.injected);
    const auto start = std::chrono::steady_clock::now();
    const Actuator::Timeout timeout = timeoutFor(fault.injected);
    const std::vector<AxisReading> readings = rig.bank.pollAll(timeout);
    EXPECT_LT(secondsSince(start), 2.0 * std::chrono::duration<double>(timeout).count());
    EXPECT_EQ(readings[0].outcome.fault, fault.seen);
    EXPECT_EQ(actuatorFaultName(readings[0].outcome.fault), fault.name);
    EXPECT_FALSE(readings[0].status);
    EXPECT_TRUE(readings[1].status) << "a neighbour must not suffer";
    const Error error = readings[0].outcome.error();
    EXPECT_EQ(error.kind, ErrorKind::kHardware);
    EXPECT_EQ(error.place, "axis axis-0");
    if (fault.seen != ActuatorFault::kUnplugged) {
      EXPECT_TRUE(rig.bank.axis(0).status(kTimeout).status) << "it did not recover";
    }
  }
}

TEST(ActuatorFaults, OrdersMeetTheSameFaults) {
  VirtualRig rig(1);
  rig.release();
  for (const NamedFault& fault : kTransferFaults) {
    if (fault.injected == VirtualFault::kShortReply) continue;  // orders have no reply
    SCOPED_TRACE(fault.name);
    rig.usb->inject(0, fault.injected, 1, tic::command::kSetTargetPosition);
    EXPECT_EQ(rig.bank.axis(0).setTarget(0.001, timeoutFor(fault.injected)).fault, fault.seen);
  }
}

TEST(ActuatorFaults, AMuteDeviceDelaysNoneOfTheOthers) {
  VirtualRig rig(kAxes);
  rig.usb->inject(3, VirtualFault::kMute, 1'000'000);
  const auto start = std::chrono::steady_clock::now();
  const std::vector<AxisOutcome> outcomes = rig.bank.haltAll(kTimeout);
  EXPECT_LT(secondsSince(start), 2.0 * kTimeout_s);
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    EXPECT_EQ(outcomes[i].fault, i == 3 ? ActuatorFault::kTimeout : ActuatorFault::kNone);
  }
}

TEST(ActuatorFaults, AnUnpluggedAxisIsMissedAndTakenUpAgainByItsSerialNumber) {
  VirtualRig rig(3);
  rig.release();
  rig.usb->unplug(1);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(rig.bank.axis(1).status(kTimeout).outcome.fault, ActuatorFault::kUnplugged);
  EXPECT_LT(secondsSince(start), kTimeout_s);
  EXPECT_FALSE(rig.bank.axis(1).connected());
  EXPECT_EQ(rig.bank.reconnectMissing(kTimeout)[1].fault, ActuatorFault::kUnplugged);

  const unsigned arrivals = rig.bank.arrivals();
  ASSERT_TRUE(rig.usb->replug(1).ok());
  for (int i = 0; i < 50 && rig.bank.arrivals() == arrivals; ++i) sleepFor(0.02);
  EXPECT_GT(rig.bank.arrivals(), arrivals);
  for (const AxisOutcome& outcome : rig.bank.reconnectMissing(kConnectTimeout)) {
    EXPECT_TRUE(outcome.ok()) << outcome.error().message();
  }
  EXPECT_EQ(rig.bank.axis(1).identity()->serial, rig.bank.axis(1).config().serial);
  const ActuatorStatus status = *rig.bank.axis(1).status().status;
  EXPECT_FALSE(status.energised) << "a device that comes back stays still";
  EXPECT_TRUE(status.position_uncertain);
  EXPECT_EQ(status.command_timeout, std::chrono::milliseconds(200));
}

TEST(ActuatorFaults, AnAxisWhoseSettingsAreNotAcceptedIsRefused) {
  const auto usb = VirtualUsb::create(ticSpecs(1));
  ASSERT_TRUE(usb.ok()) << usb.error().message();
  usb.value()->inject(0, VirtualFault::kSettingsLocked);
  auto bank = ActuatorBank::create(ticAxes(1));
  ASSERT_TRUE(bank.ok());
  const AxisOutcome outcome = bank->reconnectMissing(kConnectTimeout)[0];
  EXPECT_EQ(outcome.fault, ActuatorFault::kRefused);
  EXPECT_NE(outcome.error().message().find("1000 ms and not 200 ms"), std::string::npos)
      << outcome.error().message();
  EXPECT_FALSE(bank->axis(0).connected());
  usb.value()->clear(0, VirtualFault::kSettingsLocked);
  EXPECT_TRUE(bank->reconnectMissing(kConnectTimeout)[0].ok());
}

TEST(ActuatorFaults, AMissingDeviceIsNamedBySerialNumber) {
  const auto usb = VirtualUsb::create(ticSpecs(1));
  ASSERT_TRUE(usb.ok()) << usb.error().message();
  std::vector<AxisConfig> axes = ticAxes(2);
  auto bank = ActuatorBank::create(axes);
  ASSERT_TRUE(bank.ok());
  const std::vector<AxisOutcome> outcomes = bank->reconnectMissing(kConnectTimeout);
  EXPECT_TRUE(outcomes[0].ok());
  EXPECT_EQ(outcomes[1].fault, ActuatorFault::kUnplugged);
  EXPECT_NE(outcomes[1].error().message().find("00000002"), std::string::npos);
}

TEST(ActuatorFaults, ADeviceIsAlsoFoundByItsPort) {
  std::vector<AxisConfig> axes = ticAxes(3);
  axes[1].serial.clear();
  axes[1].port = "1-2";
  VirtualRig rig(ticSpecs(3), axes);
  EXPECT_EQ(rig.bank.axis(1).identity()->serial, "00000002");
  axes[1].serial = axes[0].serial;
  EXPECT_FALSE(ActuatorBank::create(axes).ok()) << "one device for two axes";
}

TEST(ActuatorFaults, AMuteDeviceDoesNotHideTheOthers) {
  const auto usb = VirtualUsb::create(ticSpecs(3));
  ASSERT_TRUE(usb.ok()) << usb.error().message();
  usb.value()->inject(0, VirtualFault::kMute, 1'000'000);
  auto bank = ActuatorBank::create(ticAxes(3));
  ASSERT_TRUE(bank.ok());
  const std::vector<AxisOutcome> outcomes = bank->reconnectMissing(kConnectTimeout);
  EXPECT_EQ(outcomes[0].fault, ActuatorFault::kTimeout);
  EXPECT_TRUE(outcomes[1].ok());
  EXPECT_TRUE(outcomes[2].ok());
}

TEST(ActuatorFaults, SlowAnswersAreWaitedForUpToTheTimeout) {
  VirtualRig rig(1);
  rig.usb->setLatency(0, std::chrono::milliseconds(20));
  EXPECT_TRUE(rig.bank.axis(0).status(kTimeout).status);
  rig.usb->setLatency(0, std::chrono::milliseconds(200));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(rig.bank.axis(0).status(kTimeout).outcome.fault, ActuatorFault::kTimeout);
  EXPECT_LT(secondsSince(start), 2.0 * kTimeout_s);
}

TEST(ActuatorFaults, RandomFaultsNeverGiveAReadingThatIsNotTrue) {
  VirtualRig rig(2);
  rig.release();
  constexpr double kPlace_m = 0.00123;
  ASSERT_TRUE(rig.bank.axis(0).setPosition(kPlace_m).ok());
  unsigned seed = 20240611;
  int faults = 0;
  for (int i = 0; i < 150; ++i) {
    seed = seed * 1664525u + 1013904223u;
    const NamedFault& fault = kTransferFaults[(seed >> 16) % 4];  // all but unplugging
    if ((seed >> 8) % 2 == 0) rig.usb->inject(0, fault.injected);
    const auto start = std::chrono::steady_clock::now();
    const AxisReading reading = rig.bank.axis(0).status(Actuator::Timeout{20});
    EXPECT_LT(secondsSince(start), 0.040);
    EXPECT_EQ(reading.outcome.ok(), reading.status.has_value());
    if (reading.status) {
      EXPECT_NEAR(reading.status->position_m, kPlace_m, 1e-9);
    } else {
      ++faults;
    }
  }
  EXPECT_GT(faults, 50);
}

}  // namespace
}  // namespace tenter::device_test
