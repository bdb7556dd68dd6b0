// SPDX-License-Identifier: GPL-3.0-or-later
// Random operators, faults and forces: what must hold in every tick, whatever happens.
#include <gtest/gtest.h>

#include <random>

#include "machine_bench.h"

namespace tenter::rig_test {
namespace {

constexpr int kSeeds = 60;
constexpr int kTicks = 1500;  // 30 s of the rig's time each

class RandomLife {
 public:
  explicit RandomLife(std::uint64_t seed) : random_(seed) { bench.enable(); }

  void step() {
    disturb();
    bench.step();
  }

  MachineBench bench;

 private:
  bool happens(double probability) {
    return std::uniform_real_distribution<>(0.0, 1.0)(random_) < probability;
  }
  int pick(int count) { return std::uniform_int_distribution<>(0, count - 1)(random_); }

  void disturb() {
    if (happens(0.02)) give();
    bench.extra_N = happens(0.003) ? 7.0 : happens(0.1) ? 0.0 : bench.extra_N;
    if (happens(0.003)) bench.stale_cell = pick(2);
    if (happens(0.05)) bench.stale_cell = -1;
    if (happens(0.002)) bench.stuck = pick(2);
    if (happens(0.05)) bench.stuck = -1;
    if (happens(0.002)) bench.tick.axes[static_cast<std::size_t>(pick(2))].fault = "unplugged";
    if (happens(0.05)) {
      for (AxisInput& axis : bench.tick.axes) axis.fault.clear();
    }
    bench.tick.emergency_stop = bench.tick.emergency_stop ? !happens(0.05) : happens(0.001);
    bench.tick.operator_gone = happens(0.001);
    if (happens(0.001)) bench.tick.time_ns += 300'000'000;
    if (happens(0.001)) bench.tick.trip = ForceTrip{pick(2), 6.5};
  }

  void give() {
    RigCommand command;
    command.kind = static_cast<RigCommand::Kind>(pick(13));
    if (happens(0.4)) command.kind = RigCommand::Kind::kReset;
    if (happens(0.3)) command.kind = RigCommand::Kind::kEnable;
    if (happens(0.4)) command.kind = RigCommand::Kind::kRun;
    command.axis = pick(3);
    command.distance_m = std::uniform_real_distribution<>(-0.03, 0.03)(random_);
    command.speed_m_per_s = std::uniform_real_distribution<>(0.0, 0.006)(random_);
    command.protocol =
        std::make_shared<CaptureProtocol>(*parseCaptureProtocol(benchProtocolToml(), "p.toml"));
    bench.tick.commands.push_back(command);
  }

  std::mt19937_64 random_;
};

/// How far the orders of this tick draw cords in, all together.
double loading_m(const std::vector<double>& before_m, const RigOrders& orders) {
  double sum_m = 0.0;
  for (std::size_t i = 0; i < before_m.size(); ++i) {
    if (orders.targets_m[i]) sum_m += std::max(0.0, *orders.targets_m[i] - before_m[i]);
  }
  return sum_m;
}

TEST(RigMachineProperty, LimitsHoldInEveryTick) {
  int loading_ticks = 0, halts = 0, runs = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    RandomLife life(seed);
    MachineBench& bench = life.bench;
    const RigLimits& limits = bench.machine.config().limits;
    for (int t = 0; t < kTicks; ++t) {
      const RigState before = bench.machine.state();
      life.step();
      const auto place = testing::Message() << "seed " << seed << ", tick " << t;
      // One tick's draw at the cap, and what the axes were behind before.
      const double drawn_m = loading_m(bench.position_m, bench.orders);
      ASSERT_LE(drawn_m, speedCap_m_per_s(limits) * 0.2 + 2.0 * limits.following_error_m) << place;
      if (drawn_m > 1e-9) ++loading_ticks;
      double told_m_per_s = 0.0;
      for (std::size_t i = 0; i < bench.position_m.size(); ++i) {
        const bool draws =
            bench.orders.targets_m[i] && *bench.orders.targets_m[i] > bench.position_m[i];
        if (draws) told_m_per_s += bench.orders.speeds_m_per_s[i];
      }
      ASSERT_LE(told_m_per_s, speedCap_m_per_s(limits) * (1.0 + 1e-12)) << place;
      for (const auto& target : bench.orders.targets_m) {
        if (!target) continue;
        ASSERT_GE(*target, 0.0) << place;
        ASSERT_LE(*target, 0.08) << place;
        ASSERT_FALSE(bench.orders.halt) << place;
        ASSERT_FALSE(bench.tick.emergency_stop) << place;
      }
      const bool over =
          bench.force_N(0) > limits.absolute_N || bench.force_N(1) > limits.absolute_N;
      const bool was_free = before == RigState::kReady || before == RigState::kRunning ||
                            before == RigState::kPaused || before == RigState::kCaution;
      const bool seen = bench.stale_cell < 0;
      if (over && seen && was_free) {
        ASSERT_TRUE(bench.orders.halt) << place;
      }
      if (bench.orders.halt) ++halts;
    }
    runs += bench.countOf("run-ended");
  }
  // Otherwise nothing was tried.
  EXPECT_GT(loading_ticks, 1000);
  EXPECT_GT(halts, 100);
  EXPECT_GT(runs, 50);
}

TEST(RigMachineProperty, AfterAFaultOrAStopNothingLoadsBeforeAReset) {
  int looked_at = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    RandomLife life(seed);
    MachineBench& bench = life.bench;
    for (int t = 0; t < kTicks; ++t) {
      life.step();
      const RigState state = bench.machine.state();
      if (state != RigState::kFault && state != RigState::kStopped) continue;
      for (std::size_t i = 0; i < bench.position_m.size(); ++i) {
        if (!bench.orders.targets_m[i]) continue;
        ASSERT_LE(*bench.orders.targets_m[i], bench.position_m[i])
            << "seed " << seed << ", tick " << t;
        ++looked_at;
      }
    }
  }
  EXPECT_GT(looked_at, 1000);
}

TEST(RigMachineProperty, EqualTicksGiveEqualOrders) {
  RandomLife one(7), other(7);
  for (int t = 0; t < kTicks; ++t) {
    one.step();
    other.step();
    ASSERT_EQ(one.bench.orders.targets_m, other.bench.orders.targets_m);
    ASSERT_EQ(one.bench.orders.halt, other.bench.orders.halt);
    ASSERT_EQ(one.bench.machine.reason(), other.bench.machine.reason());
  }
  EXPECT_EQ(one.bench.records.size(), other.bench.records.size());
  EXPECT_GT(one.bench.records.size(), 20U);
}

}  // namespace
}  // namespace tenter::rig_test
