// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "virtual_rig.h"

namespace tenter::device_test {
namespace {

using testing::ElementsAre;

constexpr double kOneMicrostep_m = 1e-6;

/// Keeps all axes alive until `done` or the time is over; says whether it was done.
template <class Done>
bool keepAliveUntil(VirtualRig& rig, double limit_s, Done done) {
  const auto start = std::chrono::steady_clock::now();
  while (secondsSince(start) < limit_s) {
    rig.bank.keepAliveAll(kPatience);
    if (done()) return true;
    sleepFor(0.01);
  }
  return false;
}

TEST(ActuatorMotion, EveryModelIsIdentifiedWithItsSettingsInForce) {
  VirtualRig rig(kAxes);
  const std::vector<std::string> models = {"Tic T825", "Tic T834", "Tic T500", "Tic N825",
                                           "Tic T249", "Tic 36v4", "Tic T825", "Tic T834"};
  const std::vector<AxisReading> readings = rig.bank.pollAll(kPatience);
  for (int i = 0; i < kAxes; ++i) {
    const auto identity = rig.bank.axis(i).identity();
    ASSERT_TRUE(identity);
    EXPECT_EQ(identity->model, models[static_cast<std::size_t>(i)]);
    EXPECT_EQ(identity->serial, rig.bank.axis(i).config().serial);
    const AxisReading& reading = readings[static_cast<std::size_t>(i)];
    ASSERT_TRUE(reading.status) << reading.outcome.error().message();
    EXPECT_EQ(reading.status->state, ActuatorState::kDeenergised);
    EXPECT_THAT(actuatorErrorNames(reading.status->errors & ~actuator_error::kCommandTimeout),
                ElementsAre("de-energised", "safe-start"));
    EXPECT_FALSE(reading.status->energised);
    EXPECT_TRUE(reading.status->position_uncertain);
    EXPECT_DOUBLE_EQ(*reading.status->supply_V, 12.0);
    EXPECT_EQ(reading.status->command_timeout, std::chrono::milliseconds(200));
  }
}

TEST(ActuatorMotion, TargetIsReachedAndNothingMovesBeforeSafeStartIsLeft) {
  VirtualRig rig(1);
  ASSERT_TRUE(rig.bank.axis(0).setTarget(0.0008, kPatience).ok());
  sleepFor(0.05);
  EXPECT_EQ(rig.usb->state(0).position_units, 1000.0);
  rig.release();
  sleepFor(0.05);
  EXPECT_EQ(rig.usb->state(0).position_units, 1000.0) << "the old target came back to life";
  ASSERT_TRUE(rig.bank.axis(0).setTarget(0.0008, kPatience).ok());
  EXPECT_TRUE(keepAliveUntil(rig, 2.0, [&] {
    const AxisReading reading = rig.bank.axis(0).status(kPatience);
    return reading.status && reading.status->velocity_m_per_s == 0.0 &&
           std::abs(reading.status->position_m - 0.0008) < kOneMicrostep_m;
  }));
  EXPECT_NEAR(rig.usb->state(0).position_units, 1800.0, 1.0);
  EXPECT_EQ(*rig.bank.axis(0).status(kPatience).status->velocity_m_per_s, 0.0);
}

TEST(ActuatorMotion, SpeedIsThatOfTheOrderAndOfTheLimit) {
  VirtualRig rig(1);
  rig.release();
  ASSERT_TRUE(rig.bank.axis(0).setVelocity(0.002, kPatience).ok());
  keepAliveUntil(rig, 0.2, [] { return false; });
  EXPECT_NEAR(*rig.bank.axis(0).status(kPatience).status->velocity_m_per_s, 0.002, 1e-9);
  ASSERT_TRUE(rig.bank.axis(0).setSpeedLimit(0.001, kPatience).ok());
  keepAliveUntil(rig, 0.2, [] { return false; });
  EXPECT_NEAR(*rig.bank.axis(0).status(kPatience).status->velocity_m_per_s, 0.001, 1e-9);
}

TEST(ActuatorMotion, AnAxisMountedTheOtherWayRoundHasItsOwnDirections) {
  std::vector<AxisConfig> axes = ticAxes(1);
  axes[0].metres_per_unit = -kMetresPerMicrostep;
  VirtualRig rig(ticSpecs(1), axes);
  rig.release();
  ASSERT_TRUE(rig.bank.axis(0).setVelocity(0.003, kPatience).ok());
  ASSERT_TRUE(keepAliveUntil(rig, 2.0, [&] { return rig.usb->state(0).position_units <= 0.0; }));
  sleepFor(0.02);
  const AxisReading reading = rig.bank.axis(0).status(kPatience);
  ASSERT_TRUE(reading.status);
  EXPECT_TRUE(reading.status->at_max);
  EXPECT_FALSE(reading.status->at_min);
  EXPECT_GT(reading.status->position_m, 0.0009);
}

TEST(ActuatorMotion, HomingFindsTheSwitchAndSetsTheOrigin) {
  VirtualRig rig(1);
  rig.release();
  ASSERT_TRUE(rig.bank.axis(0)
                  .setVelocity(-0.004, kPatience)
                  .ok());  // near the switch first: homing is slow
  ASSERT_TRUE(keepAliveUntil(rig, 2.0, [&] { return rig.usb->state(0).position_units < 20.0; }));
  ASSERT_TRUE(rig.bank.axis(0).haltAndHold(kPatience).ok());
  rig.bank.allowMotion();
  ASSERT_TRUE(rig.bank.axis(0).goHome(HomeTowards::kMin, kPatience).ok());
  EXPECT_TRUE(rig.bank.axis(0).status(kPatience).status->homing);
  ASSERT_TRUE(
      keepAliveUntil(rig, 3.0, [&] { return !rig.bank.axis(0).status(kPatience).status->homing; }));
  const ActuatorStatus status = *rig.bank.axis(0).status(kPatience).status;
  EXPECT_FALSE(status.position_uncertain);
  EXPECT_NEAR(status.position_m, 0.0, kOneMicrostep_m);
  EXPECT_NEAR(rig.usb->state(0).position_units, 0.0, 1.0);
}

TEST(ActuatorMotion, OrdersBeyondTheLimitsAreRefusedAndNotSent) {
  VirtualRig rig(1);
  rig.release();
  const long before = rig.usb->state(0).transfers;
  Actuator& axis = rig.bank.axis(0);
  for (const AxisOutcome& outcome :
       {axis.setTarget(0.11), axis.setTarget(-0.11), axis.setTarget(NAN), axis.setTarget(INFINITY),
        axis.setVelocity(0.006), axis.setVelocity(NAN), axis.setSpeedLimit(0.006),
        axis.setSpeedLimit(0.0), axis.setPosition(1e9)}) {
    EXPECT_EQ(outcome.fault, ActuatorFault::kOutOfRange);
  }
  EXPECT_EQ(rig.usb->state(0).transfers, before);
}

TEST(ActuatorMotion, AStopSwitchAndAKillSwitchAreSeenAndObeyed) {
  VirtualRig rig(1);
  rig.release();
  rig.settle();
  ASSERT_TRUE(rig.bank.axis(0).setVelocity(0.003, kPatience).ok());
  rig.usb->inject(0, VirtualFault::kForwardLimit);
  const ActuatorStatus limited = *rig.bank.axis(0).status(kPatience).status;
  EXPECT_TRUE(limited.at_max);
  EXPECT_EQ(rig.usb->state(0).velocity_units_per_s, 0.0);
  rig.usb->clear(0, VirtualFault::kForwardLimit);
  rig.usb->inject(0, VirtualFault::kKillSwitch);
  const ActuatorStatus killed = *rig.bank.axis(0).status(kPatience).status;
  EXPECT_EQ(killed.state, ActuatorState::kSoftError);
  EXPECT_THAT(actuatorErrorNames(killed.errors), ElementsAre("kill-switch", "safe-start"));
  EXPECT_EQ(rig.usb->state(0).velocity_units_per_s, 0.0);
  rig.usb->clear(0, VirtualFault::kKillSwitch);
  sleepFor(0.05);
  EXPECT_EQ(rig.usb->state(0).velocity_units_per_s, 0.0) << "safe start must hold it";
}

TEST(ActuatorMotion, SupplyAndDriverErrorsAreSeenAndSwitchTheMotorOff) {
  VirtualRig rig(1);
  for (const auto& [fault, name] : {std::pair{VirtualFault::kUnderVoltage, "low-supply"},
                                    std::pair{VirtualFault::kDriverError, "driver-error"}}) {
    rig.release();
    rig.settle();
    ASSERT_TRUE(rig.bank.axis(0).setVelocity(0.003, kPatience).ok());
    rig.usb->inject(0, fault);
    const ActuatorStatus status = *rig.bank.axis(0).status(kPatience).status;
    EXPECT_EQ(status.state, ActuatorState::kReset);
    EXPECT_FALSE(status.energised);
    EXPECT_THAT(actuatorErrorNames(status.errors), ElementsAre(name, "safe-start"));
    EXPECT_EQ(rig.usb->state(0).velocity_units_per_s, 0.0);
    rig.usb->clear(0, fault);
    EXPECT_TRUE(rig.bank.axis(0).clearDriverError().ok());
  }
}

TEST(ActuatorMotion, WhatHangsOnAnAxisIsToldWhereItIs) {
  VirtualRig rig(2);
  rig.release();
  std::atomic<double> seen_units{0.0};
  std::atomic<int> calls{0};
  rig.usb->observe([&](int device, const VirtualActuatorState& state) {
    if (device == 1) seen_units = state.position_units;
    ++calls;
  });
  ASSERT_TRUE(rig.bank.axis(1).setTarget(0.0003, kPatience).ok());
  ASSERT_TRUE(keepAliveUntil(rig, 2.0, [&] { return std::abs(seen_units - 1300.0) < 0.5; }));
  EXPECT_GT(calls, 20);
  rig.usb->observe(nullptr);
  const int then = calls;
  sleepFor(0.02);
  EXPECT_EQ(calls, then);
}

TEST(ActuatorMotion, ReadingsDoNotKeepAnAxisMoving) {
  VirtualRig rig(1);
  rig.release();
  ASSERT_TRUE(rig.bank.axis(0).setVelocity(0.003, kPatience).ok());
  const auto start = std::chrono::steady_clock::now();
  while (secondsSince(start) < 0.25) rig.bank.pollAll(kPatience);
  EXPECT_EQ(rig.usb->state(0).velocity_units_per_s, 0.0);
  const ActuatorStatus status = *rig.bank.axis(0).status(kPatience).status;
  EXPECT_THAT(actuatorErrorNames(status.errors), ElementsAre("command-timeout", "safe-start"));
}

}  // namespace
}  // namespace tenter::device_test
