// SPDX-License-Identifier: GPL-3.0-or-later
#include "virtual_tic.h"

#include <gtest/gtest.h>

#include <cerrno>

namespace tenter {
namespace {

using namespace std::chrono_literals;
using tic::littleEndian;

/// A Tic on a bench where time passes when told to.
class TicBench {
 public:
  explicit TicBench(VirtualActuatorSpec spec = {}) {
    spec.product = 0xC9;
    tic = makeVirtualTic(spec);
    tic->powerUp(now);
  }
  int order(int code, std::int32_t value = 0) {
    const auto bits = static_cast<std::uint32_t>(value);
    int actual = 0;
    return tic->control({0x40, static_cast<std::uint8_t>(code), static_cast<std::uint16_t>(bits),
                         static_cast<std::uint16_t>(bits >> 16), 0},
                        {}, actual);
  }
  void set(int offset, int value) {
    int actual = 0;
    tic->control(
        {0x40, 0x13, static_cast<std::uint16_t>(value), static_cast<std::uint16_t>(offset), 0}, {},
        actual);
  }
  std::uint32_t variable(int offset, int bytes) {
    std::vector<std::uint8_t> data(static_cast<std::size_t>(bytes));
    int actual = 0;
    EXPECT_EQ(tic->control({0xC0, 0xA1, 0, static_cast<std::uint16_t>(offset),
                            static_cast<std::uint16_t>(bytes)},
                           data, actual),
              0);
    return littleEndian(data, 0, bytes);
  }
  std::int32_t position() { return static_cast<std::int32_t>(variable(0x22, 4)); }
  void pass(std::chrono::nanoseconds time) {
    now += time;
    tic->advanceTo(now);
  }
  void passKeptAlive(std::chrono::milliseconds time) {
    for (auto left = time; left > 0ms; left -= 50ms) {
      order(0x8C);
      pass(50ms);
    }
  }
  void release() {
    order(0x85);
    order(0x83);
    passKeptAlive(250ms);
  }
  double speed() { return tic->state().velocity_units_per_s; }

  VirtualUsbModel::Time now{0};
  std::unique_ptr<VirtualUsbModel> tic;
};

TEST(VirtualTic, OnlyTheGuidesCommandsResetTheCommandTimeout) {
  const std::vector<int> resetting = {0xE0, 0xE3, 0xEC, 0x89, 0x85, 0x83, 0xB0, 0x8C};
  const std::vector<int> others = {0x86, 0x97, 0x8F, 0x8A, 0xE6, 0xE5, 0xEA, 0xE9};
  const auto timesOut = [](int code) {
    TicBench bench;
    bench.pass(990ms);
    EXPECT_EQ(bench.order(code), 0);
    bench.variable(0, 0x39);  // readings do not count either
    bench.pass(20ms);
    return (bench.variable(2, 2) & 0x40) != 0;
  };
  for (const int code : resetting) EXPECT_FALSE(timesOut(code)) << std::hex << code;
  for (const int code : others) EXPECT_TRUE(timesOut(code)) << std::hex << code;
}

TEST(VirtualTic, TheTimeoutStopsAtItsMomentAsTheResponseSettingSays) {
  for (const int response : {1, 2}) {
    TicBench bench;
    bench.set(0x09, 200);
    bench.set(0x0A, 0);
    bench.set(0x53, response);
    bench.order(0x10);
    bench.release();
    bench.order(0xE3, 1'000'000);  // 100 microsteps/s, reached after 0.25 s
    bench.passKeptAlive(500ms);
    EXPECT_NEAR(bench.speed(), 100.0, 1e-9);
    bench.order(0x8C);
    const double then = bench.tic->state().position_units;
    bench.pass(199ms);
    EXPECT_NEAR(bench.speed(), 100.0, 1e-9);
    bench.pass(2ms);
    EXPECT_EQ(bench.speed() == 0.0, response == 1);
    bench.pass(1s);
    EXPECT_EQ(bench.speed(), 0.0);
    const double braking = response == 1 ? 0.0 : 100.0 * 100.0 / (2.0 * 400.0);
    EXPECT_NEAR(bench.tic->state().position_units - then, 20.0 + braking, 0.2);
    EXPECT_EQ(bench.variable(2, 2), 0xC0u);
    bench.order(0x8C);
    EXPECT_EQ(bench.variable(2, 2), 0x80u) << "safe start stays";
  }
}

TEST(VirtualTic, SettingsTakeEffectUponReinitialiseOnly) {
  TicBench bench;
  bench.set(0x09, 200);
  bench.set(0x0A, 0);
  bench.order(0x8C);
  bench.pass(500ms);
  EXPECT_EQ(bench.variable(2, 2) & 0x40, 0u);
  bench.order(0x10);
  bench.order(0x8C);
  bench.pass(201ms);
  EXPECT_EQ(bench.variable(2, 2) & 0x40, 0x40u);
}

TEST(VirtualTic, GoesToItsTargetWithRampsAndStopsOnIt) {
  TicBench bench;
  bench.release();
  bench.order(0xE0, 300);
  bench.passKeptAlive(200ms);
  EXPECT_NEAR(bench.speed(), 80.0, 0.1);  // 400 microsteps/s^2 for 0.2 s
  double fastest = 0.0, furthest = 0.0;
  for (int i = 0; i < 40; ++i) {
    bench.passKeptAlive(50ms);
    fastest = std::max(fastest, bench.speed());
    furthest = std::max(furthest, bench.tic->state().position_units);
  }
  EXPECT_NEAR(fastest, 200.0, 0.5);
  EXPECT_LE(furthest, 300.0);
  EXPECT_EQ(bench.position(), 300);
  EXPECT_EQ(bench.speed(), 0.0);
}

TEST(VirtualTic, SafeStartHoldsAfterAnErrorAndTheOldTargetIsRemembered) {
  TicBench bench;
  bench.release();
  bench.order(0xE0, 300);
  bench.passKeptAlive(100ms);
  bench.tic->setCondition(VirtualFault::kKillSwitch, true);
  bench.tic->setCondition(VirtualFault::kKillSwitch, false);
  bench.passKeptAlive(500ms);
  EXPECT_EQ(bench.speed(), 0.0);
  bench.order(0x83);
  bench.passKeptAlive(100ms);
  EXPECT_GT(bench.speed(), 0.0) << "which is why the driver halts before it leaves safe start";
}

TEST(VirtualTic, LimitSwitchesStopOneDirectionOnly) {
  VirtualActuatorSpec spec;
  spec.forward_switch_units = 50.0;
  TicBench bench(spec);
  bench.release();
  bench.order(0xE3, 2'000'000);
  bench.passKeptAlive(2000ms);
  EXPECT_EQ(bench.speed(), 0.0);
  EXPECT_NEAR(bench.tic->state().position_units, 50.0, 0.1);
  EXPECT_EQ(bench.variable(1, 1) & 0x04, 0x04u);
  bench.order(0xE3, -2'000'000);
  bench.passKeptAlive(200ms);
  EXPECT_LT(bench.speed(), 0.0);
}

TEST(VirtualTic, HomingNeedsASwitch) {
  TicBench bench;
  bench.release();
  bench.order(0x97, 0);
  bench.passKeptAlive(100ms);
  EXPECT_EQ(bench.variable(1, 1) & 0x10, 0u);
  EXPECT_EQ(bench.speed(), 0.0);
}

TEST(VirtualTic, JammedMechanicsLeaveTheCountBehind) {
  TicBench bench;
  bench.release();
  bench.tic->setCondition(VirtualFault::kJammed, true);
  bench.order(0xE0, 100);
  bench.passKeptAlive(2000ms);
  EXPECT_EQ(bench.position(), 100);
  EXPECT_EQ(bench.tic->state().position_units, 0.0);
}

TEST(VirtualTic, UnknownRequestsAreStalled) {
  TicBench bench;
  EXPECT_EQ(bench.order(0x42), -EPIPE);
  std::vector<std::uint8_t> data(8);
  int actual = 7;
  EXPECT_EQ(bench.tic->control({0xC0, 0xA1, 0, 0x50, 8}, data, actual), -EPIPE);
  EXPECT_EQ(actual, 0);
  EXPECT_EQ(bench.tic->control({0x40, 0x13, 1, 0x200, 0}, {}, actual), -EPIPE);
}

}  // namespace
}  // namespace tenter
