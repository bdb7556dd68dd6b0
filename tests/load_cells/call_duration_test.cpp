// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <thread>

#include "load_cell_bench.h"
#include "tenter/rig/modbus_link.h"

namespace tenter::load_cell_tests {
namespace {

using Kind = VirtualCellFaultKind;
using std::chrono::milliseconds;

constexpr std::int64_t kTimeout_ns = 30'000'000;
constexpr std::int64_t kScheduling_ns = 10'000'000;
constexpr int kCalls = 9;

struct Case {
  Wire wire;
  VirtualCellFault fault;
};

void PrintTo(const Case& test, std::ostream* out) {
  *out << (test.wire == Wire::kTcp ? "tcp " : "rtu ") << virtualCellFaultName(test.fault);
}

/// The middle one of several: the machine may keep a call waiting once, but not every second time.
std::int64_t middleDuration_ns(ModbusLink& link) {
  std::vector<std::int64_t> durations_ns;
  for (int i = 0; i < kCalls; ++i) {
    std::array<std::uint16_t, 8> words{};
    const std::int64_t begin_ns = monotonic_ns();
    const ModbusAnswer answer = link.read(1, 3, 6, words);
    durations_ns.push_back(monotonic_ns() - begin_ns);
    EXPECT_NE(answer.fault, LoadCellFault::kNone);
  }
  std::nth_element(durations_ns.begin(), durations_ns.begin() + kCalls / 2, durations_ns.end());
  return durations_ns[kCalls / 2];
}

class CallDurationTest : public testing::TestWithParam<Case> {};

TEST_P(CallDurationTest, NoCallTakesLongerThanTwiceItsTimeout) {
  BenchOptions options;
  options.wire = GetParam().wire;
  options.paced = false;
  Bench bench(options);
  ModbusTiming timing;
  timing.response_timeout_ns = kTimeout_ns;
  timing.longest_latency_ns = 5 * kTimeout_ns;
  ModbusLink link(bench.configs()[0].address, timing);
  bench.cell(0).inject(GetParam().fault);
  EXPECT_LE(middleDuration_ns(link), 2 * kTimeout_ns + kScheduling_ns);
}

INSTANTIATE_TEST_SUITE_P(
    Faults, CallDurationTest,
    testing::Values(Case{Wire::kTcp, {Kind::kSilence, 0, {}, 0}},
                    Case{Wire::kRtu, {Kind::kSilence, 0, {}, 0}},
                    // Without a limit on the whole answer it would take half a second.
                    Case{Wire::kTcp, {Kind::kDribble, 0, milliseconds(20), 0}},
                    Case{Wire::kRtu, {Kind::kDribble, 0, milliseconds(20), 0}},
                    Case{Wire::kTcp, {Kind::kLateAnswer, 0, milliseconds(100), 0}},
                    Case{Wire::kRtu, {Kind::kLateAnswer, 0, milliseconds(100), 0}},
                    Case{Wire::kTcp, {Kind::kHangUp, 0, {}, 0}},
                    Case{Wire::kRtu, {Kind::kHangUp, 0, {}, 0}}));

TEST(AbsentServerTest, CostsNoMoreThanTheTimeout) {
  ModbusTiming timing;
  timing.response_timeout_ns = kTimeout_ns;
  timing.first_back_off_ns = 1;
  timing.last_back_off_ns = 1;
  // TEST-NET-1 of RFC 5737: packets there get no answer, or no route.
  ModbusLink nowhere(parseModbusAddress("tcp:192.0.2.1:502").value(), timing);
  EXPECT_LE(middleDuration_ns(nowhere), kTimeout_ns + kScheduling_ns);
  ModbusLink no_device(parseModbusAddress("rtu:/dev/tenter-is-not-here").value(), timing);
  EXPECT_LE(middleDuration_ns(no_device), kTimeout_ns + kScheduling_ns);
}

}  // namespace
}  // namespace tenter::load_cell_tests
