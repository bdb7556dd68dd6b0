// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cstdio>
#include <thread>

#include "load_cell_bench.h"

namespace tenter::load_cell_tests {
namespace {

constexpr int kCells = 8;
constexpr std::chrono::milliseconds kMeasured{2000};
// Eight requests and answers with their gaps and 3 ms turnaround at 115200 baud take 70 ms on the
// wire. The machine may do other things too: half as much again, and a tenth fewer than 200 scans.
constexpr double kFastestRtuScan_ms = 69.0, kSlowestRtuScan_ms = 105.0;
constexpr double kFewestTcpScans_per_s = 180.0;

struct Rates {
  double scans_per_s, mean_ms, longest_ms;
  std::uint64_t failures;
};

Rates measure(Bench& bench) {
  for (int i = 0; i < kCells; ++i) bench.setForce(i, 1.0 + i);
  const auto scanner = bench.startScanner();
  const auto allRead = [&] {
    for (int i = 0; i < kCells; ++i) {
      if (scanner->reading(i).samples == 0) return false;
    }
    return true;
  };
  EXPECT_TRUE(waitFor(allRead));
  std::uint64_t failures_before = 0, failures_after = 0;
  for (int i = 0; i < kCells; ++i) failures_before += scanner->reading(i).failures;
  const std::uint64_t before = scanner->statistics(0).scans;
  std::this_thread::sleep_for(kMeasured);
  const LoadCellScanStatistics after = scanner->statistics(0);
  for (int i = 0; i < kCells; ++i) {
    const LoadCellReading reading = scanner->reading(i);
    failures_after += reading.failures;
    EXPECT_NEAR(reading.last_gross_N, 1.0 + i, 0.02) << "cell " << i;
  }
  const double seconds = std::chrono::duration<double>(kMeasured).count();
  return {static_cast<double>(after.scans - before) / seconds,
          1e-6 * static_cast<double>(after.mean_ns), 1e-6 * static_cast<double>(after.longest_ns),
          failures_after - failures_before};
}

void print(const char* what, const Rates& rates) {
  std::printf("%s: %.0f scans/s, mean %.2f ms, longest %.2f ms\n", what, rates.scans_per_s,
              rates.mean_ms, rates.longest_ms);
}

TEST(ScanRateTest, TcpReadsEightCellsTwoHundredTimesASecond) {
  Bench bench({.wire = Wire::kTcp, .cells = kCells});
  const Rates rates = measure(bench);
  print("TCP, eight amplifiers", rates);
  EXPECT_GE(rates.scans_per_s, kFewestTcpScans_per_s);
  EXPECT_EQ(rates.failures, 0U);
}

TEST(ScanRateTest, RtuReadsEightCellsAtTheSpeedOfTheWireAndKeepsItsGaps) {
  Bench bench({.wire = Wire::kRtu, .cells = kCells});
  const Rates rates = measure(bench);
  print("RTU at 115200 baud, eight amplifiers", rates);
  EXPECT_GE(rates.mean_ms, kFastestRtuScan_ms);  // faster, and the wire's pace was not kept
  EXPECT_LE(rates.mean_ms, kSlowestRtuScan_ms);
  EXPECT_EQ(rates.failures, 0U);
  EXPECT_EQ(bench.server(0).counts().early_requests, 0U);
}

}  // namespace
}  // namespace tenter::load_cell_tests
