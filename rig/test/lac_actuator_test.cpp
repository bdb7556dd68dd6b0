// SPDX-License-Identifier: GPL-3.0-or-later
#include "lac_actuator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "usb_script_run.h"

namespace tenter::rig_test {
namespace {

AxisConfig axisConfig() {
  AxisConfig axis;
  axis.name = "lifter";
  axis.driver = "lac";
  axis.port = "1-4.2";
  axis.metres_per_unit = 1e-4;
  axis.travel_max_m = 0.1;
  axis.max_speed_m_per_s = 0.005;
  axis.full_speed_m_per_s = 0.02;
  return axis;
}

/// Answers each packet as the board does.
struct FakeLac {
  int position = 500;
  std::vector<std::array<int, 2>> heard;
  std::vector<std::uint8_t> answer;

  std::vector<std::uint8_t> operator()(const UsbRequest& request) {
    if (request.silence_is_answer) return {};
    if (request.endpoint == 0x81) return answer;
    const int value = request.out[1] | request.out[2] << 8;
    heard.push_back({request.out[0], value});
    const int says = request.out[0] == 0x10 || request.out[0] == 0x20 ? position : value;
    answer = {request.out[0], static_cast<std::uint8_t>(says & 0xFF),
              static_cast<std::uint8_t>(says >> 8)};
    return {};
  }
};

using Heard = std::vector<std::array<int, 2>>;

TEST(LacActuator, StartSilencesTheKnobsAndHoldsWhereItIs) {
  LacActuator driver(axisConfig());
  FakeLac device;
  EXPECT_EQ(play(driver.start(), std::ref(device)).end.fault, ActuatorFault::kNone);
  EXPECT_EQ(device.heard, (Heard{{0x30, 0}, {0x10, 0}, {0x20, 500}, {0x21, 255}}));
  EXPECT_DOUBLE_EQ(driver.lastStatus().position_m, 0.05);
}

TEST(LacActuator, ItIsHomingUntilItIsAtTheEnd) {
  LacActuator driver(axisConfig());
  FakeLac device;
  play(driver.start(), std::ref(device));
  EXPECT_FALSE(driver.lastStatus().homing);
  play(driver.goHome(HomeTowards::kMin), std::ref(device));
  EXPECT_TRUE(driver.lastStatus().homing);
  device.position = 200;
  play(driver.keepAlive(), std::ref(device));
  play(driver.readStatus(), std::ref(device));
  EXPECT_TRUE(driver.lastStatus().homing);
  device.position = 5;  // its controller stands there
  play(driver.keepAlive(), std::ref(device));
  play(driver.readStatus(), std::ref(device));
  EXPECT_FALSE(driver.lastStatus().homing);
  device.position = 500;
  play(driver.goHome(HomeTowards::kMin), std::ref(device));
  play(driver.haltAndHold(), std::ref(device));
  EXPECT_FALSE(driver.lastStatus().homing) << "a halt ends it";
}

TEST(LacActuator, SeesNoKillSwitch) {
  AxisConfig axis = axisConfig();
  axis.kill_switch = true;
  EXPECT_FALSE(checkLacConfig(axis).ok());
}

TEST(LacActuator, TheTargetNeverLeadsByMoreThanTheTimeoutAtTheSetSpeed) {
  LacActuator driver(axisConfig());  // 5 mm/s for 200 ms is 1 mm, ten counts
  FakeLac device;
  play(driver.setTarget(0.08), std::ref(device));
  EXPECT_EQ(device.heard, (Heard{{0x10, 0}, {0x20, 510}}));
  device.heard.clear();
  device.position = 506;
  play(driver.keepAlive(), std::ref(device));
  EXPECT_EQ(device.heard, (Heard{{0x10, 0}, {0x20, 516}}));
  device.heard.clear();
  device.position = 795;
  play(driver.keepAlive(), std::ref(device));
  EXPECT_EQ(device.heard, (Heard{{0x10, 0}, {0x20, 800}})) << "and not beyond the goal";
  device.heard.clear();
  play(driver.setSpeedLimit(0.001), std::ref(device));
  play(driver.setTarget(0.0), std::ref(device));
  EXPECT_EQ(device.heard, (Heard{{0x21, 51}, {0x10, 0}, {0x20, 793}}));
}

TEST(LacActuator, HaltsAtItsFeedbackAndHoldsFromThenOn) {
  LacActuator driver(axisConfig());
  FakeLac device;
  play(driver.setTarget(0.08), std::ref(device));
  device.heard.clear();
  device.position = 503;
  play(driver.haltAndHold(), std::ref(device));
  EXPECT_EQ(device.heard, (Heard{{0x10, 0}, {0x20, 503}}));
  device.heard.clear();
  play(driver.keepAlive(), std::ref(device));
  EXPECT_TRUE(device.heard.empty());
}

TEST(LacActuator, AnswersToOtherPacketsOrOffTheScaleAreNoReadings) {
  LacActuator driver(axisConfig());
  for (const std::vector<std::uint8_t>& bytes :
       {std::vector<std::uint8_t>{0x20, 0xF4, 0x01}, {0x10, 0x00, 0x04}, {0x10, 0xF4}, {}}) {
    const ScriptRun run = play(driver.readStatus(), [&](const UsbRequest& request) {
      return request.silence_is_answer ? std::vector<std::uint8_t>{} : bytes;
    });
    EXPECT_EQ(run.end.fault, ActuatorFault::kWrongReply);
  }
}

TEST(LacActuator, AfterAnUnfinishedOperationThePipeIsEmptiedFirst) {
  LacActuator driver(axisConfig());
  FakeLac device;
  play(driver.start(), std::ref(device));
  UsbScript cut_short = driver.readStatus();
  EXPECT_EQ(cut_short(nullptr).request->endpoint, 0x01);  // sent, and its answer never fetched
  int stale = 2;
  const ScriptRun run = play(driver.readStatus(), [&](const UsbRequest& request) {
    if (request.silence_is_answer && stale-- > 0) return std::vector<std::uint8_t>{0x10, 1, 0};
    return device(request);
  });
  EXPECT_EQ(run.end.fault, ActuatorFault::kNone);
  EXPECT_EQ(run.sent.size(), 5u);  // three to drain, a question, its answer
  EXPECT_DOUBLE_EQ(driver.lastStatus().position_m, 0.05);
  EXPECT_EQ(play(driver.readStatus(), std::ref(device)).sent.size(), 2u);
}

TEST(LacActuator, WhatItCannotDoIsRefused) {
  LacActuator driver(axisConfig());
  for (const UsbScript& script :
       {driver.setTarget(0.2), driver.setTarget(-0.01), driver.setVelocity(0.006),
        driver.setSpeedLimit(0.0004), driver.setPosition(0.01)}) {
    const ScriptRun run = play(script, FakeLac());
    EXPECT_TRUE(run.sent.empty());
    EXPECT_EQ(run.end.fault, ActuatorFault::kOutOfRange);
  }
  const auto refused = [](const auto& change) {
    AxisConfig axis = axisConfig();
    change(axis);
    return !checkAxisConfig(axis).ok();
  };
  EXPECT_TRUE(checkAxisConfig(axisConfig()).ok());
  EXPECT_TRUE(refused([](AxisConfig& a) { a.full_speed_m_per_s = 0.0; }));
  EXPECT_TRUE(refused([](AxisConfig& a) { a.max_speed_m_per_s = 0.03; }));
  EXPECT_TRUE(refused([](AxisConfig& a) { a.max_speed_m_per_s = 0.0004; }));
  EXPECT_TRUE(refused([](AxisConfig& a) { a.travel_max_m = 0.2; }));
}

}  // namespace
}  // namespace tenter::rig_test
