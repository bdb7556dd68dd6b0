// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/rig_machine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "machine_bench.h"

namespace tenter::rig_test {
namespace {

using Kind = RigCommand::Kind;
using testing::HasSubstr;

TEST(RigMachineTest, ComesUpAndRunsAProtocolToItsEnd) {
  MachineBench bench;
  EXPECT_EQ(bench.machine.state(), RigState::kOff);
  EXPECT_THAT(bench.run(), HasSubstr("off"));
  bench.enable();
  ASSERT_EQ(bench.machine.state(), RigState::kReady) << bench.machine.reason();
  ASSERT_EQ(bench.run(), "");
  ASSERT_TRUE(bench.loadUpTo(2.9));
  ASSERT_TRUE(bench.reach(RigState::kReady));
  EXPECT_TRUE(bench.orders.run_ended);
  EXPECT_EQ(bench.countOf("step"), 6);
  EXPECT_EQ(bench.countOf("unloaded"), 1);
  EXPECT_GT(bench.countOf("capture"), 8);
  EXPECT_LE(bench.force_N(0), 0.05);
}

TEST(RigMachineTest, ForceEndsAreMetWithinOneTickOfTravel) {
  MachineBench bench;
  bench.enable();
  ASSERT_EQ(bench.run(), "");
  double highest_N = 0.0;
  while (bench.machine.state() == RigState::kRunning) {
    bench.step();
    highest_N = std::max(highest_N, bench.force_N(0));
  }
  // The cap holds both axes to 0.01 m/s together; two ticks until the order takes effect.
  EXPECT_GE(highest_N, 3.0);
  EXPECT_LE(highest_N, 3.0 + 2.0 * kTick_s * 0.008 * kSample_N_per_m + 1e-9);
}

TEST(RigMachineTest, AbsoluteForceHaltsInTheSameTickAndUnloads) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(2.0));
  bench.extra_N = 5.0;
  bench.step();
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_EQ(bench.machine.state(), RigState::kFault);
  EXPECT_TRUE(bench.hasFault("absolute-force"));
  bench.extra_N = 0.0;
  bench.steps(500);
  EXPECT_EQ(bench.countOf("unloaded"), 1);
  EXPECT_EQ(bench.machine.state(), RigState::kFault);
  EXPECT_THAT(bench.run(), HasSubstr("fault"));
  EXPECT_EQ(bench.command(Kind::kReset), "");
  EXPECT_EQ(bench.machine.state(), RigState::kReady);
}

TEST(RigMachineTest, TareDoesNotMoveTheAbsoluteLimit) {
  MachineBench bench;
  bench.extra_N = 0.04;
  bench.enable();
  ASSERT_EQ(bench.command(Kind::kTare), "");
  bench.steps(30);
  EXPECT_NEAR(bench.machine.tares_N()[0], 0.04, 1e-12);
  EXPECT_EQ(bench.machine.purpose().how, "done");
  bench.extra_N = 6.01;  // 5.97 N against the tare
  bench.step();
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_TRUE(bench.hasFault("absolute-force"));
}

TEST(RigMachineTest, ALoadIsNoTare) {
  for (const double load_N : {0.06, 1.5}) {  // from slack_N on
    MachineBench bench;
    bench.extra_N = load_N;
    bench.enable();
    bench.command(Kind::kTare);
    bench.steps(30);
    EXPECT_EQ(bench.countOf("tare-refused"), 1);
    EXPECT_EQ(bench.machine.tares_N()[0], 0.0);
    EXPECT_EQ(bench.machine.purpose().how, "refused");
    EXPECT_THAT(bench.machine.purpose().why, HasSubstr("under load"));
  }
}

TEST(RigMachineTest, WhatSwingsHasNoZero) {
  MachineBench bench;
  bench.enable();
  bench.command(Kind::kTare);
  for (int i = 0; i < 30; ++i) {
    bench.extra_N = i % 2 == 0 ? 0.04 : -0.04;
    bench.step();
  }
  EXPECT_EQ(bench.machine.purpose().how, "refused");
  EXPECT_THAT(bench.machine.purpose().why, HasSubstr("not steady"));
}

TEST(RigMachineTest, AWrongSignIsNoSmallerAForce) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(1.0));
  bench.extra_N = -6.5;
  bench.step();
  EXPECT_TRUE(bench.orders.halt);
}

TEST(RigMachineTest, AJogUnderAFaultNeedsItsOperator) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(1.0));
  bench.tick.trip = ForceTrip{0, 7.0};
  bench.step();
  bench.steps(500);
  ASSERT_EQ(bench.machine.state(), RigState::kFault);
  ASSERT_EQ(bench.jog(0, -0.005), "");
  bench.steps(5);
  ASSERT_TRUE(bench.machine.busy());
  bench.tick.operator_gone = true;
  bench.step();
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_FALSE(bench.machine.busy());
  EXPECT_TRUE(bench.hasFault("lease-lost"));
}

TEST(RigMachineTest, UnloadingGoesOnWithoutItsOperator) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(2.0));
  bench.tick.operator_gone = true;
  bench.steps(500);
  EXPECT_TRUE(bench.hasFault("lease-lost"));
  EXPECT_EQ(bench.countOf("unloaded"), 1);
  EXPECT_EQ(bench.countOf("not-unloaded"), 0);
}

TEST(RigMachineTest, UnloadingGoesOnThoughNothingCanBeWritten) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(2.0));
  ASSERT_EQ(bench.command(Kind::kAbort), "");
  bench.steps(3);
  bench.tick.recorder_fault = "no room";
  bench.steps(500);
  EXPECT_TRUE(bench.hasFault("not-written"));
  EXPECT_EQ(bench.machine.state(), RigState::kFault);
  EXPECT_EQ(bench.countOf("unloaded"), 1);
  EXPECT_EQ(bench.countOf("not-unloaded"), 0);
}

TEST(RigMachineTest, WhatIsLostWhileARunIsPausedEndsIt) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(2.0));
  ASSERT_EQ(bench.command(Kind::kPause), "");
  bench.steps(10);
  bench.mute_axis = 1;
  bench.steps(10);
  EXPECT_EQ(bench.machine.state(), RigState::kFault);
}

TEST(RigMachineTest, SeveralJogsAreLetOutToWhereTheCordWasSlack) {
  MachineBench bench;
  bench.own_springs = true;
  bench.enable();
  for (int i = 0; i < 4; ++i) {  // 0.6 N in the end
    ASSERT_EQ(bench.jog(0, 0.001), "");
    ASSERT_TRUE(bench.reach(RigState::kReady));
  }
  ASSERT_GT(bench.force_N(0), 0.5);
  ASSERT_EQ(bench.jog(0, 0.001), "");
  bench.stale_cell = 0;
  bench.steps(500);
  EXPECT_LE(bench.force_N(0), 0.05);
  EXPECT_EQ(bench.countOf("unloaded"), 0) << "nobody saw that it is";
  EXPECT_EQ(bench.countOf("not-unloaded"), 1);
}

TEST(RigMachineTest, AMachineWithItsMemoryLetsOutToTheSamePlace) {
  MachineBench bench;
  bench.own_springs = true;
  bench.enable();
  ASSERT_EQ(bench.jog(0, 0.002), "");  // taut from 1 mm on
  ASSERT_TRUE(bench.reach(RigState::kReady));
  RigMachine again(bench.machine.config(), bench.machine.memory());
  RigCommand run;
  run.kind = Kind::kRun;
  run.protocol =
      std::make_shared<CaptureProtocol>(*parseCaptureProtocol(benchProtocolToml(), "p.toml"));
  run.mapping = RigCommand::Mapping::kCheck;
  bench.tick.commands.push_back(run);
  for (int i = 0; i < 300; ++i) {
    if (i == 5) bench.stale_cell = 0;
    const std::vector<RigCommand> commands = bench.tick.commands;
    bench.step();
    RigTick tick = bench.tick;
    tick.commands = commands;
    ASSERT_EQ(again.step(tick).targets_m, bench.orders.targets_m) << i;
  }
  EXPECT_TRUE(bench.hasFault("silence"));
  EXPECT_LE(bench.position_m[0], 0.01 + 1e-9) << "to where the cord was slack, before the jog";
  EXPECT_EQ(again.reason(), bench.machine.reason());
}

TEST(RigMachineTest, CurrentIsTakenAwayUntilItIsGone) {
  MachineBench bench;
  bench.enable();
  bench.command(Kind::kDisable);
  for (AxisInput& axis : bench.tick.axes) axis.energised = true;  // it did not come through
  bench.step();
  EXPECT_TRUE(bench.orders.deenergise);
  for (AxisInput& axis : bench.tick.axes) axis.energised = false;
  bench.step();
  EXPECT_FALSE(bench.orders.deenergise);
}

TEST(RigMachineTest, AWatchBetweenTicksTripsThoughTheForceIsGone) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(1.0));
  bench.tick.trip = ForceTrip{1, 7.5};
  bench.step();
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_EQ(bench.machine.reason(), "cell-2: absolute-force");
}

TEST(RigMachineTest, AStaleCellStopsMotionAndUnloadsByTheOthersAndByPosition) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(2.0));
  bench.stale_cell = 0;
  for (int i = 0; i < 5; ++i) {  // 100 ms
    bench.step();
    EXPECT_THAT(bench.orders.targets_m, testing::Each(std::nullopt));
    EXPECT_FALSE(bench.orders.halt);
  }
  bench.step();
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_TRUE(bench.hasFault("silence"));
  bench.steps(1000);
  EXPECT_LE(bench.force_N(1), 0.05);
  EXPECT_LE(bench.position_m[0], 0.01 + 1e-9);
  EXPECT_EQ(bench.countOf("unloaded"), 0);
  EXPECT_THAT(bench.machine.reason(), HasSubstr("cell-1 gives no tension"));
}

TEST(RigMachineTest, ACellThatIsBackInTimeLetsTheRunGoOn) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(1.0));
  bench.stale_cell = 0;
  bench.steps(3);
  bench.stale_cell = -1;
  ASSERT_TRUE(bench.reach(RigState::kReady));
  EXPECT_EQ(bench.countOf("step"), 6);
}

TEST(RigMachineTest, ASecondFaultBesideTheFirstDoesNotKeepTheOthersLoaded) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(2.0));
  bench.tick.trip = ForceTrip{0, 7.0};
  bench.tick.axes[1].fault = "stall";
  bench.step();
  bench.step();
  bench.tick.axes[1].fault.clear();
  bench.steps(500);
  EXPECT_EQ(bench.countOf("unloaded"), 1);
}

TEST(RigMachineTest, AnOldSampleIsStale) {
  MachineBench bench;
  bench.enable();
  bench.run();
  bench.tick.cells[1].age_ns = RigMachine::kStale_ns + 1;
  bench.step();
  EXPECT_THAT(bench.orders.targets_m, testing::Each(std::nullopt));
  bench.steps(5);
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_TRUE(bench.hasFault("stale"));
}

TEST(RigMachineTest, AnAxisThatDoesNotFollowIsAFaultAndWhatRemainsIsSaid) {
  MachineBench bench;
  bench.own_springs = true;
  ASSERT_TRUE(bench.pulls(2.0));
  bench.stuck = 0;
  bench.steps(100);
  EXPECT_TRUE(bench.hasFault("following-error"));
  bench.steps(1000);
  EXPECT_EQ(bench.countOf("unloaded"), 0);
  EXPECT_EQ(bench.countOf("not-unloaded"), 1);
  EXPECT_LE(bench.force_N(1), 0.05) << "the other cord is let out";
  EXPECT_THAT(bench.machine.reason(), HasSubstr("axis-1 does not follow"));
}

TEST(RigMachineTest, AnAxisThatDrawsInWhileCordsAreLetOutHaltsAll) {
  MachineBench bench;
  bench.own_springs = true;
  ASSERT_TRUE(bench.pulls(2.0));
  ASSERT_EQ(bench.command(Kind::kAbort), "");
  bench.steps(8);
  bench.stuck = 0;
  for (int i = 0; i < 20 && !bench.orders.halt; ++i) {
    bench.position_m[0] += 1e-4;
    bench.step();
  }
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_TRUE(bench.hasFault("following-error"));
  EXPECT_FALSE(bench.machine.busy());
  EXPECT_THAT(bench.machine.reason(), HasSubstr("axis-1"));
}

TEST(RigMachineTest, AnAxisMayAnswerLateButNotForLong) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(1.0));
  bench.mute_axis = 1;
  bench.steps(5);  // 100 ms
  EXPECT_EQ(bench.machine.state(), RigState::kRunning);
  bench.step();
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_EQ(bench.machine.reason(), "axis-2: timeout");
}

TEST(RigMachineTest, ForceSlopeIsBounded) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(1.0));
  bench.extra_N = 3.5;  // below the working force
  bench.steps(6);
  EXPECT_TRUE(bench.hasFault("force-slope"));
}

TEST(RigMachineTest, MovesAwayFromALimitAlwaysWorkAndTowardsItNever) {
  MachineBench bench;
  bench.enable();
  bench.position_m = bench.goal_m = {0.025, 0.025};  // 5.6 N: above the working force
  bench.steps(2);
  EXPECT_EQ(bench.machine.state(), RigState::kCaution);
  EXPECT_THAT(bench.jog(0, 0.001), HasSubstr("only moves that unload"));
  EXPECT_EQ(bench.jog(0, -0.001), "");
  bench.steps(60);
  EXPECT_NEAR(bench.position_m[0], 0.024, 1e-9);
  bench.stale_cell = 1;
  EXPECT_EQ(bench.jog(0, -0.001), "");
  bench.steps(60);
  bench.command(Kind::kStop);
  EXPECT_EQ(bench.machine.state(), RigState::kStopped);
  EXPECT_EQ(bench.jog(0, -0.001), "");
  bench.steps(60);
  EXPECT_NEAR(bench.position_m[0], 0.022, 1e-9);
  EXPECT_EQ(bench.machine.state(), RigState::kStopped);
}

TEST(RigMachineTest, BeyondTravelOnlyTheWayBackIsOpen) {
  MachineBench bench;
  bench.enable();
  bench.position_m = bench.goal_m = {0.0, -0.002};
  bench.step();
  EXPECT_THAT(bench.jog(1, -0.001), HasSubstr("travel"));
  EXPECT_EQ(bench.jog(1, 0.003), "");
  for (int i = 0; i < 120; ++i) {
    bench.step();
    if (bench.orders.targets_m[1]) {
      EXPECT_GE(*bench.orders.targets_m[1], 0.0);
    }
  }
  EXPECT_NEAR(bench.position_m[1], 0.001, 1e-9);
}

TEST(RigMachineTest, PauseHoldsAndResumeGoesOn) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(1.0));
  ASSERT_EQ(bench.command(Kind::kPause), "");
  bench.steps(3);
  const auto held_m = bench.position_m;
  bench.steps(200);
  EXPECT_EQ(bench.position_m, held_m);
  bench.extra_N = 5.5;
  bench.step();
  EXPECT_EQ(bench.machine.state(), RigState::kFault) << "limits hold in a pause too";
}

TEST(RigMachineTest, ResumedProtocolsEnd) {
  MachineBench bench;
  bench.enable();
  bench.run();
  bench.loadUpTo(1.0);
  bench.command(Kind::kPause);
  bench.steps(200);
  ASSERT_EQ(bench.command(Kind::kResume), "");
  ASSERT_TRUE(bench.reach(RigState::kReady));
  EXPECT_EQ(bench.countOf("step"), 6);
}

TEST(RigMachineTest, AbortUnloadsAndIsReadyAgain) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(2.0));
  ASSERT_EQ(bench.command(Kind::kAbort), "");
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_FALSE(bench.orders.run_ended) << "unloading belongs to the session";
  ASSERT_TRUE(bench.reach(RigState::kReady));
  EXPECT_EQ(bench.countOf("unloaded"), 1);
  EXPECT_TRUE(bench.orders.run_ended);
}

TEST(RigMachineTest, EmergencyStopIsObeyedUntilReleasedAndReset) {
  MachineBench bench;
  ASSERT_TRUE(bench.pulls(2.0));
  bench.tick.emergency_stop = true;
  bench.step();
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_EQ(bench.machine.state(), RigState::kStopped);
  EXPECT_EQ(bench.countOf("not-unloaded"), 1);
  EXPECT_THAT(bench.jog(0, -0.001), HasSubstr("emergency"));
  EXPECT_THAT(bench.command(Kind::kReset), HasSubstr("emergency"));
  bench.tick.emergency_stop = false;
  EXPECT_EQ(bench.command(Kind::kUnload), "");
  bench.steps(1000);
  EXPECT_EQ(bench.countOf("unloaded"), 1);
  EXPECT_EQ(bench.command(Kind::kReset), "");
  EXPECT_EQ(bench.machine.state(), RigState::kReady);
}

TEST(RigMachineTest, ALostOperatorADeadRecorderAndALateTickEndInUnloading) {
  for (const std::string fault : {"lease-lost", "not-written", "late-tick"}) {
    MachineBench bench;
    bench.enable();
    bench.run();
    ASSERT_TRUE(bench.loadUpTo(2.0));
    if (fault == "lease-lost") bench.tick.operator_gone = true;
    if (fault == "not-written") bench.tick.recorder_fault = "no space left";
    if (fault == "late-tick") bench.tick.time_ns += RigMachine::kLateTick_ns;
    bench.step();
    EXPECT_TRUE(bench.orders.halt) << fault;
    EXPECT_TRUE(bench.hasFault(fault));
    bench.steps(1000);
    EXPECT_EQ(bench.countOf("unloaded"), 1) << fault;
  }
}

TEST(RigMachineTest, NothingButUnloadingBeforeHoming) {
  MachineBench bench;
  bench.tick.axes[1].position_certain = false;
  bench.enable();
  EXPECT_EQ(bench.machine.state(), RigState::kCaution);
  EXPECT_THAT(bench.run(), HasSubstr("not homed"));
  bench.extra_N = 1.0;
  EXPECT_THAT(bench.command(Kind::kHome), HasSubstr("unload first"));
  bench.extra_N = 0.0;
  ASSERT_EQ(bench.command(Kind::kHome), "");
  EXPECT_TRUE(bench.orders.home);
  bench.tick.axes[1].homing = true;
  bench.steps(50);
  EXPECT_EQ(bench.machine.state(), RigState::kRunning);
  bench.tick.axes[1].homing = false;
  bench.tick.axes[1].position_certain = true;
  bench.steps(1);
  EXPECT_EQ(bench.machine.state(), RigState::kReady);
}

TEST(RigMachineTest, AForceThatIsNeverReachedEndsTheRun) {
  MachineBench bench;
  bench.enable();
  std::string toml = benchProtocolToml();
  toml.replace(toml.find("limit_m = 0.05"), 14, "limit_m = 0.002");
  ASSERT_EQ(bench.run(toml), "");
  ASSERT_TRUE(bench.reach(RigState::kFault));
  EXPECT_TRUE(bench.hasFault("force-not-reached"));
}

TEST(RigMachineTest, HomesUnderLoadOnlyWhatHasLostItsCount) {
  MachineBench bench;
  bench.enable();
  bench.extra_N = 1.0;
  bench.position_m = {0.0005, 0.01};  // the first cord cannot be let out any further
  bench.goal_m = bench.position_m;
  bench.step();
  EXPECT_THAT(bench.command(Kind::kHome), HasSubstr("under load"));
  bench.tick.axes[0].position_certain = false;
  bench.steps(2);
  EXPECT_EQ(bench.command(Kind::kHome), "");
}

TEST(RigMachineTest, ASwitchThatStaysPressedEndsTheHoming) {
  MachineBench bench;
  bench.enable();
  ASSERT_EQ(bench.command(Kind::kHome), "");
  bench.tick.axes[1].homing = true;
  bench.steps(20);
  EXPECT_EQ(bench.machine.state(), RigState::kRunning);
  bench.goal_m[1] = bench.position_m[1] + 0.002;  // away from the switch, and on
  bench.steps(60);
  EXPECT_TRUE(bench.hasFault("homing-astray"));
  EXPECT_EQ(bench.machine.state(), RigState::kFault);
}

}  // namespace
}  // namespace tenter::rig_test
