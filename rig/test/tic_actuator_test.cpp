// SPDX-License-Identifier: GPL-3.0-or-later
#include "tic_actuator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "usb_script_run.h"

namespace tenter::rig_test {
namespace {

using testing::ElementsAre;

AxisConfig axisConfig() {
  AxisConfig axis;
  axis.name = "weft-left";
  axis.serial = "00123456";
  axis.metres_per_unit = 1e-6;
  axis.origin_m = 0.01;
  axis.travel_min_m = -0.05;
  axis.travel_max_m = 0.05;
  axis.max_speed_m_per_s = 0.004;
  axis.max_acceleration_m_per_s2 = 0.1;
  return axis;
}

/// Bytes as the maker's guide lays them out, written by hand.
std::vector<std::uint8_t> variableBytes() {
  std::vector<std::uint8_t> bytes(0x39, 0);
  bytes[0x00] = 10;                                                    // normal
  bytes[0x01] = 0x05;                                                  // energised, forward limit
  bytes[0x02] = 0x40;                                                  // command time-out
  bytes[0x04] = 0xC0;                                                  // and safe start, once
  bytes[0x22] = 0x18, bytes[0x23] = bytes[0x24] = bytes[0x25] = 0xFC;  // -50529256
  bytes[0x26] = 0x10, bytes[0x27] = 0x27;                              // 10000: one microstep/s
  bytes[0x33] = 0xE0, bytes[0x34] = 0x2E;                              // 12000 mV
  return bytes;
}

struct FakeTic {
  std::vector<std::uint8_t> settings = std::vector<std::uint8_t>(0x69, 0);
  bool obeys = true;

  FakeTic() {
    settings[0x09] = 0xE8, settings[0x0A] = 0x03;  // 1000 ms
    settings[0x53] = 2;
  }
  std::vector<std::uint8_t> operator()(const UsbRequest& request) {
    if (request.code == 0x13 && obeys) {
      settings[request.index] = static_cast<std::uint8_t>(request.value);
    }
    if (request.code == 0xA8) return settings;
    if (request.code == 0xA1) return variableBytes();
    return {};
  }
};

TEST(TicActuator, AnEmergencyStopThatItWouldNotSeeIsRefused) {
  AxisConfig axis = axisConfig();
  axis.kill_switch = true;
  FakeTic device;
  TicActuator blind(axis);
  const ScriptRun refused = play(blind.start(), std::ref(device));
  EXPECT_EQ(refused.end.fault, ActuatorFault::kRefused);
  EXPECT_THAT(refused.end.detail, testing::HasSubstr("kill_switch"));
  device.settings[0x5D] = 8;
  TicActuator seeing(axis);
  EXPECT_EQ(play(seeing.start(), std::ref(device)).end.fault, ActuatorFault::kNone);
}

std::vector<int> codesOf(const ScriptRun& run) {
  std::vector<int> codes;
  codes.reserve(run.sent.size());
  for (const UsbRequest& request : run.sent) codes.push_back(request.code);
  return codes;
}

TEST(TicActuator, StatusIsDecodedFromTheGuidesBytes) {
  TicActuator driver(axisConfig());
  const ScriptRun run = play(driver.readStatus(), [](const auto&) { return variableBytes(); });
  ASSERT_EQ(run.end.fault, ActuatorFault::kNone);
  ASSERT_EQ(run.sent.size(), 1u);
  EXPECT_EQ(run.sent[0].type, 0xC0);
  EXPECT_EQ(run.sent[0].code, 0xA1);
  EXPECT_EQ(run.sent[0].index, 0);
  EXPECT_EQ(run.sent[0].reply_length, 0x39);
  const ActuatorStatus& status = driver.lastStatus();
  EXPECT_DOUBLE_EQ(status.position_m, 0.01 - 50.529256);
  EXPECT_DOUBLE_EQ(*status.velocity_m_per_s, 1e-6);
  EXPECT_DOUBLE_EQ(*status.supply_V, 12.0);
  EXPECT_EQ(status.state, ActuatorState::kNormal);
  EXPECT_TRUE(status.energised);
  EXPECT_TRUE(status.at_max);
  EXPECT_FALSE(status.at_min);
  EXPECT_FALSE(status.position_uncertain);
  EXPECT_THAT(actuatorErrorNames(status.errors), ElementsAre("command-timeout"));
  EXPECT_THAT(actuatorErrorNames(status.errors_occurred),
              ElementsAre("command-timeout", "safe-start"));
}

TEST(TicActuator, AStateThatDoesNotExistIsNoReading) {
  TicActuator driver(axisConfig());
  for (const int state : {1, 3, 11, 12, 255}) {
    std::vector<std::uint8_t> bytes = variableBytes();
    bytes[0] = static_cast<std::uint8_t>(state);
    const ScriptRun run = play(driver.readStatus(), [&](const auto&) { return bytes; });
    EXPECT_EQ(run.end.fault, ActuatorFault::kWrongReply);
  }
  EXPECT_EQ(driver.lastStatus().position_m, 0.0);
}

TEST(TicActuator, StartWritesOnlyWhatDiffersAndReadsItBack) {
  TicActuator driver(axisConfig());
  FakeTic device;
  ScriptRun run = play(driver.start(), std::ref(device));
  EXPECT_EQ(run.end.fault, ActuatorFault::kNone) << run.end.detail;
  const std::vector<int> codes = codesOf(run);
  EXPECT_EQ(std::count(codes.begin(), codes.end(), 0x13), 3 + 6);  // the speeds' high bytes are 0
  EXPECT_THAT(std::vector<int>(codes.end() - 6, codes.end()),
              ElementsAre(0x10, 0xE6, 0xEA, 0xE9, 0xA8, 0xA1));
  EXPECT_EQ(device.settings[0x09], 200);
  EXPECT_EQ(device.settings[0x0A], 0);
  EXPECT_EQ(device.settings[0x53], 1) << "halt and hold";
  const auto speed = run.sent.end() - 5;
  EXPECT_EQ(speed->value | speed->index << 16, 40'000'000);              // 4000 microsteps/s
  EXPECT_EQ((speed + 1)->value | (speed + 1)->index << 16, 10'000'000);  // 1e5 microsteps/s^2
  EXPECT_EQ(tic::littleEndian(device.settings, 0x61, 4), 20'000'000U) << "homing, half of that";
  EXPECT_EQ(tic::littleEndian(device.settings, 0x65, 4), 2'000'000U) << "off the switch";
  run = play(driver.start(), std::ref(device));
  EXPECT_THAT(codesOf(run), ElementsAre(0xA8, 0x10, 0xE6, 0xEA, 0xE9, 0xA8, 0xA1));
  EXPECT_EQ(driver.lastStatus().command_timeout, std::chrono::milliseconds(200));
}

TEST(TicActuator, StartRefusesWhatCannotBeMadeSafe) {
  TicActuator driver(axisConfig());
  FakeTic deaf;
  deaf.obeys = false;
  FakeTic other_mode;
  other_mode.settings[0x01] = 1;
  FakeTic no_safe_start;
  no_safe_start.settings[0x03] = 1;
  for (FakeTic* device : {&deaf, &other_mode, &no_safe_start}) {
    const ScriptRun run = play(driver.start(), std::ref(*device));
    EXPECT_EQ(run.end.fault, ActuatorFault::kRefused);
    for (const UsbRequest& request : run.sent) {
      EXPECT_THAT((std::vector<int>{0x85, 0x83, 0xE0, 0xE3, 0x97}),
                  testing::Not(testing::Contains(request.code)));
    }
  }
}

TEST(TicActuator, OrdersAreTheGuidesRequests) {
  TicActuator driver(axisConfig());
  struct Case {
    UsbScript script;
    std::vector<int> codes;
    std::int32_t value;  // of the last request
  };
  const std::vector<Case> cases = {
      {driver.setTarget(-0.02), {0xE0}, -30'000},
      {driver.setVelocity(-0.001), {0xE3}, -10'000'000},
      {driver.setSpeedLimit(0.001), {0xE6}, 10'000'000},
      {driver.setPosition(0.01), {0xEC}, 0},
      {driver.haltAndHold(), {0x89}, 0},
      {driver.energise(), {0x89, 0x85}, 0},
      {driver.deenergise(), {0x86}, 0},
      {driver.exitSafeStart(), {0x89, 0x83}, 0},
      {driver.clearDriverError(), {0x8A}, 0},
      {driver.goHome(HomeTowards::kMin), {0x97}, 0},
      {driver.goHome(HomeTowards::kMax), {0x97}, 1},
      {driver.keepAlive(), {0x8C}, 0},
  };
  for (const Case& one : cases) {
    const ScriptRun run = play(one.script, FakeTic());
    EXPECT_EQ(codesOf(run), one.codes);
    const UsbRequest& last = run.sent.back();
    EXPECT_EQ(last.type, 0x40);
    EXPECT_EQ(static_cast<std::int32_t>(last.value | static_cast<std::uint32_t>(last.index) << 16),
              one.value);
  }
}

TEST(TicActuator, HomingTurnsWithTheAxis) {
  AxisConfig axis = axisConfig();
  axis.metres_per_unit = -1e-6;
  TicActuator driver(axis);
  EXPECT_EQ(play(driver.goHome(HomeTowards::kMin), FakeTic()).sent[0].value, 1);
}

TEST(ActuatorConfig, WhatCannotBeIsRefusedWithItsField) {
  EXPECT_TRUE(checkAxisConfig(axisConfig()).ok());
  const auto refused = [](const char* field, const auto& change) {
    AxisConfig axis = axisConfig();
    change(axis);
    const Result<void> result = checkAxisConfig(axis);
    ASSERT_FALSE(result.ok()) << field;
    EXPECT_THAT(result.error().message(), testing::HasSubstr(field));
  };
  refused("name", [](AxisConfig& a) { a.name.clear(); });
  refused("driver", [](AxisConfig& a) { a.driver = "servo"; });
  refused("serial", [](AxisConfig& a) { a.serial.clear(); });
  refused("metres_per_unit", [](AxisConfig& a) { a.metres_per_unit = 0.0; });
  refused("metres_per_unit", [](AxisConfig& a) { a.metres_per_unit = NAN; });
  refused("travel", [](AxisConfig& a) { a.travel_max_m = a.travel_min_m; });
  refused("travel", [](AxisConfig& a) { a.travel_max_m = 50.0; });
  refused("travel", [](AxisConfig& a) {
    a.metres_per_unit = 1e-12;
    a.max_speed_m_per_s = 1e-9;
    a.max_acceleration_m_per_s2 = 1e-6;
  });
  refused("max_speed_m_per_s", [](AxisConfig& a) { a.max_speed_m_per_s = 4.0; });
  refused("max_speed_m_per_s", [](AxisConfig& a) { a.max_speed_m_per_s = NAN; });
  refused("max_speed_m_per_s", [](AxisConfig& a) { a.metres_per_unit = 1e-8; });
  refused("max_acceleration", [](AxisConfig& a) { a.max_acceleration_m_per_s2 = 0.0; });
  refused("command_timeout",
          [](AxisConfig& a) { a.command_timeout = std::chrono::milliseconds(0); });
  refused("origin_m", [](AxisConfig& a) { a.origin_m = INFINITY; });
}

TEST(ActuatorConfig, EveryDriverIsInTheTableOnce) {
  for (const ActuatorDriverRow& row : actuatorDrivers()) {
    EXPECT_EQ(findActuatorDriver(row.id), &row);
    EXPECT_FALSE(row.products.empty());
  }
  EXPECT_EQ(findActuatorDriver("tic")->products.size(), 6u);
}

}  // namespace
}  // namespace tenter::rig_test
