// SPDX-License-Identifier: GPL-3.0-or-later
// What the daemon's loop and its watch go by, without devices.
#include <gtest/gtest.h>

#include <thread>

#include "force_alarm.h"
#include "lateness.h"

namespace tenter::daemon {
namespace {

using namespace std::chrono_literals;

LoadCellReading reading(double gross_N, LoadCellFault fault = LoadCellFault::kNone) {
  LoadCellReading reading;
  reading.fault = fault;
  reading.last_gross_N = gross_N;
  reading.samples = 1;
  reading.scan_ns = 1'000'000'000;
  reading.stamp_ns = reading.attempt_ns = monotonic_ns();
  return reading;
}

TEST(Lateness, QuantilesAreTheUpperEndsOfTheirBins) {
  Lateness lateness;
  for (int i = 0; i < 99; ++i) lateness.add(50'000);
  lateness.add(12'340'000);
  EXPECT_DOUBLE_EQ(lateness.quantile_ms(0.99), 0.1);
  EXPECT_DOUBLE_EQ(lateness.quantile_ms(1.0), 12.34);  // not more than the worst
  EXPECT_DOUBLE_EQ(lateness.worst_ms(), 12.34);
}

TEST(Lateness, WhatIsBeyondTheBinsIsTheWorst) {
  Lateness lateness;
  lateness.add(90'000'000);
  lateness.add(206'000'000);
  EXPECT_DOUBLE_EQ(lateness.quantile_ms(0.5), 206.0);
}

TEST(ForceAlarm, KnowsTheLimitAndWhatIsBeyondTheRange) {
  const ForceAlarm alarm(6.0);
  const std::int64_t now_ns = monotonic_ns();
  EXPECT_FALSE(alarm.beyond(reading(6.0), now_ns));
  EXPECT_TRUE(alarm.beyond(reading(6.1), now_ns));
  EXPECT_TRUE(alarm.beyond(reading(0.0, LoadCellFault::kOverRange), now_ns));
  EXPECT_FALSE(alarm.beyond(reading(9.0, LoadCellFault::kSilence), now_ns));
}

TEST(ForceAlarm, WakesWhoWaitsAndIsNotLostOnWhoWaitsLater) {
  constexpr auto kLong = 10s;
  ForceAlarm alarm(6.0);
  alarm.look(reading(7.0));
  const auto begin = std::chrono::steady_clock::now();
  alarm.wait(kLong);  // rung before
  std::thread reader([&] {
    std::this_thread::sleep_for(20ms);
    alarm.look(reading(7.0));
  });
  alarm.wait(kLong);  // rung meanwhile
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kLong / 2);
  reader.join();
  alarm.look(reading(5.0));
  const auto quiet = std::chrono::steady_clock::now();
  alarm.wait(5ms);
  EXPECT_GE(std::chrono::steady_clock::now() - quiet, 5ms);
}

}  // namespace
}  // namespace tenter::daemon
