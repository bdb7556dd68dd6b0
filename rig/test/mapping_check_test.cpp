// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/mapping_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "machine_bench.h"

namespace tenter::rig_test {
namespace {

using Kind = RigCommand::Kind;
using testing::HasSubstr;

/// Cords that each hang on a spring of their own, so that a cell feels its own axis alone.
class HungBench : public MachineBench {
 public:
  HungBench() { own_springs = true; }
  std::string checkMapping(std::vector<int> axes = {}) {
    RigCommand check;
    check.kind = Kind::kCheckMapping;
    check.axes = std::move(axes);
    return command(check);
  }
  std::string runChecked(RigCommand::Mapping mapping = RigCommand::Mapping::kCheck) {
    RigCommand run;
    run.kind = Kind::kRun;
    run.protocol =
        std::make_shared<CaptureProtocol>(*parseCaptureProtocol(benchProtocolToml(), "p.toml"));
    run.mapping = mapping;
    return command(run);
  }
  /// Until nothing moves; the way of each axis at the end of it.
  void finish() {
    for (int i = 0; i < 3000 && machine.moving(); ++i) step();
  }
  std::string faultText() const {
    for (const RecordBody& record : records) {
      if (const auto* fault = std::get_if<FaultEvent>(&record)) return fault->text;
    }
    return "";
  }
};

TEST(MappingCheckTest, ConfirmsEachAxisAndPutsItBack) {
  HungBench bench;
  bench.enable();
  const std::vector<double> before_m = bench.position_m;
  ASSERT_EQ(bench.checkMapping(), "");
  bench.finish();
  EXPECT_EQ(bench.machine.state(), RigState::kReady);
  ASSERT_EQ(bench.machine.mapping().size(), 2U);
  for (const MappingFinding& finding : bench.machine.mapping()) {
    EXPECT_TRUE(finding.confirmed());
    EXPECT_EQ(finding.answered, finding.axis);
    EXPECT_LT(finding.way_m, 0.005);
    EXPECT_THAT(mappingText(finding, bench.machine.config()), HasSubstr(" answers"));
  }
  for (std::size_t i = 0; i < before_m.size(); ++i) {
    EXPECT_NEAR(bench.position_m[i], before_m[i], 1e-6);
  }
  EXPECT_EQ(bench.countOf("mapping"), 2);
}

TEST(MappingCheckTest, NamesCrossedCellsAndRefusesTheRun) {
  HungBench bench;
  bench.crossed = true;
  bench.enable();
  ASSERT_EQ(bench.runChecked(), "");
  bench.finish();
  EXPECT_EQ(bench.machine.state(), RigState::kFault);
  EXPECT_TRUE(bench.hasFault("mapping"));
  EXPECT_EQ(bench.countOf("run"), 0) << "the protocol never began";
  EXPECT_EQ(bench.faultText(),
            "axis-1: cell-2 answers instead of cell-1; axis-2: cell-1 answers instead of cell-2");
}

TEST(MappingCheckTest, AnAxisThatNothingHangsOnIsNamed) {
  HungBench bench;
  bench.enable();
  ASSERT_EQ(bench.checkMapping({0}), "");
  bench.finish();
  EXPECT_EQ(bench.machine.state(), RigState::kReady);
  bench.slack_m = 0.02;  // beyond the check's reach
  ASSERT_EQ(bench.checkMapping({1}), "");
  bench.finish();
  EXPECT_EQ(bench.machine.state(), RigState::kFault);
  EXPECT_EQ(bench.faultText(), "axis-2: no cell answers");
}

TEST(MappingCheckTest, TwoCellsThatAnswerAlikeConfirmNothing) {
  MachineBench bench;  // one spring between both cords
  bench.enable();
  RigCommand check;
  check.kind = Kind::kCheckMapping;
  ASSERT_EQ(bench.command(check), "");
  for (int i = 0; i < 3000 && bench.machine.moving(); ++i) bench.step();
  EXPECT_EQ(bench.machine.state(), RigState::kFault);
  EXPECT_FALSE(bench.machine.mapping().at(0).alone);
}

TEST(MappingCheckTest, ARunGoesOnWithItsProtocolAndAsksOnlyOnce) {
  HungBench bench;
  bench.enable();
  ASSERT_EQ(bench.runChecked(), "");
  bench.finish();
  EXPECT_EQ(bench.countOf("mapping"), 2);
  EXPECT_EQ(bench.countOf("unloaded"), 1);
  ASSERT_EQ(bench.machine.state(), RigState::kReady);
  ASSERT_EQ(bench.runChecked(), "");
  bench.finish();
  EXPECT_EQ(bench.countOf("mapping"), 2) << "nothing was unplugged since";
  EXPECT_EQ(bench.countOf("run"), 2);
  bench.tick.axes[1].energised = false;
  bench.step();
  bench.enable();
  ASSERT_EQ(bench.machine.state(), RigState::kReady);
  ASSERT_EQ(bench.runChecked(), "");
  bench.finish();
  EXPECT_EQ(bench.countOf("mapping"), 3) << "of the axis that was without current";
}

TEST(MappingCheckTest, SkippingItIsRecorded) {
  HungBench bench;
  bench.crossed = true;
  bench.enable();
  ASSERT_EQ(bench.runChecked(RigCommand::Mapping::kSkip), "");
  EXPECT_EQ(bench.countOf("mapping-check-skipped"), 1);
  EXPECT_EQ(bench.countOf("run"), 1);
}

TEST(MappingCheckTest, LimitsHoldMeanwhileAndItUnloads) {
  HungBench bench;
  bench.enable();
  ASSERT_EQ(bench.checkMapping(), "");
  bench.steps(30);
  bench.extra_N = 7.0;
  bench.step();
  EXPECT_TRUE(bench.orders.halt);
  EXPECT_EQ(bench.machine.state(), RigState::kFault);
  bench.extra_N = 0.0;
  bench.finish();
  EXPECT_EQ(bench.countOf("unloaded"), 1);
}

TEST(MappingCheckTest, AbortingItUnloads) {
  HungBench bench;
  bench.enable();
  ASSERT_EQ(bench.runChecked(), "");
  bench.steps(30);
  ASSERT_EQ(bench.command(Kind::kAbort), "");
  bench.finish();
  EXPECT_EQ(bench.countOf("unloaded"), 1);
  EXPECT_EQ(bench.countOf("run"), 0);
}

TEST(MappingCheckTest, RefusesWhatCannotBeTried) {
  HungBench bench;
  EXPECT_THAT(bench.checkMapping(), HasSubstr("the rig is off"));
  bench.enable();
  EXPECT_EQ(bench.checkMapping({7}), "there is no such axis");
}

}  // namespace
}  // namespace tenter::rig_test
