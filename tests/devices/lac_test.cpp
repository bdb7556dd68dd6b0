// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "tenter/rig/lac_protocol.h"
#include "virtual_rig.h"

namespace tenter::device_test {
namespace {

constexpr double kLead_units = 20.0;  // 0.01 m/s for 200 ms in counts of 0.1 mm
constexpr double kOneCount = 1.0;

struct LacRig : VirtualRig {
  LacRig() : VirtualRig({lacSpec()}, {lacAxis()}) {}
};

TEST(Lac, IsIdentifiedAndHeldWhereItStands) {
  LacRig rig;
  EXPECT_EQ(rig.bank.axis(0).identity()->model, "Actuonix LAC");
  EXPECT_EQ(rig.bank.axis(0).identity()->serial, "LAC-7");
  const ActuatorStatus status = *rig.bank.axis(0).status(kPatience).status;
  EXPECT_NEAR(status.position_m, 0.03, kMetresPerCount);
  EXPECT_EQ(status.command_timeout.count(), 0) << "it has none of its own";
  EXPECT_FALSE(status.velocity_m_per_s);
  EXPECT_FALSE(status.supply_V);
  sleepFor(0.1);
  EXPECT_EQ(rig.usb->state(0).position_units, 300.0);
}

TEST(Lac, ReachesItsGoalAtTheSetSpeedWhileItIsKeptAlive) {
  LacRig rig;
  ASSERT_TRUE(rig.bank.axis(0).setTarget(0.034, kPatience).ok());
  const auto start = std::chrono::steady_clock::now();
  while (std::abs(rig.usb->state(0).position_units - 340.0) > 0.5 && secondsSince(start) < 2.0) {
    ASSERT_TRUE(rig.bank.axis(0).keepAlive(kPatience).ok());
    sleepFor(0.02);
  }
  const double took_s = secondsSince(start);
  EXPECT_NEAR(rig.usb->state(0).position_units, 340.0, kOneCount);
  EXPECT_GT(took_s, 0.35);  // 4 mm at 10 mm/s
  EXPECT_LT(took_s, 0.6);
}

TEST(Lac, WithoutItsHostItGoesNoFurtherThanItsLead) {
  LacRig rig;
  ASSERT_TRUE(rig.bank.axis(0).setTarget(0.09, kPatience).ok());
  sleepFor(0.4);
  EXPECT_LE(rig.usb->state(0).position_units, 300.0 + kLead_units);
  EXPECT_EQ(rig.usb->state(0).velocity_units_per_s, 0.0);
  EXPECT_GT(rig.usb->state(0).position_units, 300.0 + kLead_units / 2.0);
}

TEST(Lac, HaltsWhereItIsAndForgetsItsGoal) {
  LacRig rig;
  ASSERT_TRUE(rig.bank.axis(0).setVelocity(0.01, kPatience).ok());
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(rig.bank.axis(0).keepAlive(kPatience).ok());
    sleepFor(0.02);
  }
  ASSERT_TRUE(rig.bank.axis(0).haltAndHold(kPatience).ok());
  const double halted_at = rig.usb->state(0).position_units;
  EXPECT_GT(halted_at, 302.0);
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(rig.bank.axis(0).keepAlive(kPatience).ok());
    sleepFor(0.02);
  }
  EXPECT_NEAR(rig.usb->state(0).position_units, halted_at, kOneCount);
  EXPECT_EQ(rig.bank.axis(0).setTarget(0.05, kPatience).fault, ActuatorFault::kHalted);
}

TEST(Lac, NamesEveryFaultAndRecovers) {
  LacRig rig;
  for (const auto& [injected, seen] :
       {std::pair{VirtualFault::kStall, ActuatorFault::kStall},
        std::pair{VirtualFault::kProtocolError, ActuatorFault::kProtocolError},
        std::pair{VirtualFault::kMute, ActuatorFault::kTimeout}}) {
    rig.usb->inject(0, injected);
    EXPECT_EQ(rig.bank.axis(0).status().outcome.fault, seen);
    EXPECT_TRUE(rig.bank.axis(0).status(kPatience).status);
  }
  rig.usb->inject(0, VirtualFault::kShortReply);
  EXPECT_EQ(rig.bank.axis(0).status().outcome.fault, ActuatorFault::kShortReply);
  EXPECT_TRUE(rig.bank.axis(0).status(kPatience).status);
  rig.usb->inject(0, VirtualFault::kUnplugInTransfer);
  EXPECT_EQ(rig.bank.axis(0).status(kConnectTimeout).outcome.fault, ActuatorFault::kUnplugged);
  ASSERT_TRUE(rig.usb->replug(0).ok());
  EXPECT_TRUE(rig.bank.reconnectMissing(kConnectTimeout)[0].ok());
}

TEST(Lac, AnAnswerThatComesLateIsNotTakenForTheNext) {
  LacRig rig;
  ASSERT_TRUE(rig.bank.axis(0).setTarget(0.04, kPatience).ok());
  // The question goes through and its answer is given up: it stays in the device's pipe.
  rig.usb->setLatency(0, std::chrono::milliseconds(30));
  EXPECT_EQ(rig.bank.axis(0).status(Actuator::Timeout{45}).outcome.fault, ActuatorFault::kTimeout);
  rig.usb->setLatency(0, std::chrono::microseconds(0));
  sleepFor(0.3);
  const AxisReading reading = rig.bank.axis(0).status();
  ASSERT_TRUE(reading.status);
  EXPECT_NEAR(reading.status->position_m, kMetresPerCount * rig.usb->state(0).position_units,
              kMetresPerCount);
}

TEST(Lac, AndTicsHaltTogether) {
  std::vector<VirtualActuatorSpec> specs = ticSpecs(2);
  std::vector<AxisConfig> axes = ticAxes(2);
  specs.push_back(lacSpec());
  axes.push_back(lacAxis());
  VirtualRig rig(specs, axes);
  rig.release();
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(rig.bank.axis(i).setVelocity(0.004, kPatience).ok());
  ASSERT_TRUE(rig.bank.keepAliveAll(kPatience)[2].ok());
  sleepFor(0.05);
  for (const AxisOutcome& outcome : rig.bank.haltAll(kPatience)) {
    EXPECT_TRUE(outcome.ok()) << outcome.error().message();
  }
  sleepFor(0.03);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(rig.usb->state(i).velocity_units_per_s, 0.0);
}

}  // namespace
}  // namespace tenter::device_test
