// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <thread>

#include "tenter/rig/tic_protocol.h"
#include "virtual_rig.h"

namespace tenter::device_test {
namespace {

constexpr int kRuns = 100;
constexpr double kHaltBound_s =
    0.025;  // 99th percentile, all eight, from the call to the last answer
constexpr double kSpeed_m_per_s = 0.002;

/// Prints the quantiles and returns the 99th percentile [s].
double reportQuantiles(const char* what, std::vector<double> seconds) {
  std::sort(seconds.begin(), seconds.end());
  const auto quantile = [&](double q) {
    return seconds[static_cast<std::size_t>(q * static_cast<double>(seconds.size() - 1))];
  };
  std::printf("%s: n %zu, p50 %.2f ms, p99 %.2f ms, max %.2f ms\n", what, seconds.size(),
              1e3 * quantile(0.5), 1e3 * quantile(0.99), 1e3 * quantile(1.0));
  return quantile(0.99);
}

bool allOk(const std::vector<AxisOutcome>& outcomes) {
  return std::all_of(outcomes.begin(), outcomes.end(), [](const auto& o) { return o.ok(); });
}

TEST(ActuatorHalt, EightAxesHaltTogether) {
  VirtualRig rig(kAxes);
  rig.release();
  std::vector<double> halts, polls;
  for (int run = 0; run < kRuns; ++run) {
    rig.bank.allowMotion();
    for (int i = 0; i < kAxes; ++i) {
      const double sign = run % 2 == 0 ? 1.0 : -1.0;
      ASSERT_TRUE(rig.bank.axis(i).setVelocity(sign * kSpeed_m_per_s, kPatience).ok());
    }
    auto start = std::chrono::steady_clock::now();
    for (const AxisReading& reading : rig.bank.pollAll(kPatience)) ASSERT_TRUE(reading.status);
    polls.push_back(secondsSince(start));
    start = std::chrono::steady_clock::now();
    ASSERT_TRUE(allOk(rig.bank.haltAll(kPatience)));
    halts.push_back(secondsSince(start));
    for (int i = 0; i < kAxes; ++i) EXPECT_EQ(rig.usb->state(i).velocity_units_per_s, 0.0);
  }
  reportQuantiles("poll of eight axes", polls);
  EXPECT_LT(reportQuantiles("halt of eight axes", halts), kHaltBound_s);
}

TEST(ActuatorHalt, CutsShortAnOrderThatWaitsForAMuteDevice) {
  VirtualRig rig(kAxes);
  rig.release();
  for (int i = 0; i < kAxes; ++i) {
    ASSERT_TRUE(rig.bank.axis(i).setVelocity(kSpeed_m_per_s, kPatience).ok());
    rig.usb->inject(i, VirtualFault::kMute, 1, tic::command::kGetVariable);
  }
  std::vector<AxisReading> readings;
  std::thread poll([&] { readings = rig.bank.pollAll(Actuator::Timeout{1000}); });
  sleepFor(0.03);
  const auto start = std::chrono::steady_clock::now();
  const std::vector<AxisOutcome> outcomes = rig.bank.haltAll(kPatience);
  const double took_s = secondsSince(start);
  poll.join();
  EXPECT_TRUE(allOk(outcomes));
  EXPECT_LT(took_s, 2.0 * kHaltBound_s);
  for (int i = 0; i < kAxes; ++i) EXPECT_EQ(rig.usb->state(i).velocity_units_per_s, 0.0);
  for (const AxisReading& reading : readings) {
    EXPECT_EQ(reading.outcome.fault, ActuatorFault::kPreempted);
  }
}

TEST(ActuatorHalt, NoOrderUndoesItUntilMotionIsAllowedAgain) {
  VirtualRig rig(2);
  rig.release();
  std::atomic<bool> stop{false};
  std::atomic<int> refused{0};
  std::thread motion([&] {
    for (int i = 0; !stop; ++i) {
      const double target_m = i % 2 == 0 ? 0.0005 : 0.0015;
      for (const AxisOutcome& outcome : rig.bank.setTargets({target_m, target_m})) {
        if (outcome.fault == ActuatorFault::kHalted) ++refused;
      }
    }
  });
  sleepFor(0.05);
  EXPECT_TRUE(allOk(rig.bank.haltAll(Actuator::Timeout{200})));
  const double halted_at = rig.usb->state(0).position_units;
  sleepFor(0.1);
  EXPECT_EQ(rig.usb->state(0).position_units, halted_at);
  EXPECT_GT(refused, 0);
  rig.bank.allowMotion();
  sleepFor(0.1);
  EXPECT_NE(rig.usb->state(0).position_units, halted_at);
  stop = true;
  motion.join();
}

TEST(ActuatorHalt, OneAxisIsHaltedWhileTheOthersGoOn) {
  VirtualRig rig(2);
  rig.release();
  for (int i = 0; i < 2; ++i)
    ASSERT_TRUE(rig.bank.axis(i).setVelocity(kSpeed_m_per_s, kPatience).ok());
  ASSERT_TRUE(rig.bank.axis(0).haltAndHold(kPatience).ok());
  EXPECT_EQ(rig.usb->state(0).velocity_units_per_s, 0.0);
  EXPECT_GT(rig.usb->state(1).velocity_units_per_s, 0.0);
  EXPECT_TRUE(rig.bank.axis(0).status(kPatience).status->position_uncertain);
}

}  // namespace
}  // namespace tenter::device_test
