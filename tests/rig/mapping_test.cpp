// SPDX-License-Identifier: GPL-3.0-or-later
// Whether each axis pulls its own cell, with the shipped programs on a rig that was wired wrongly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "running_rig.h"
#include "tenter/core/files.h"
#include "tenter/session/replay.h"
#include "tenter/session/session_reader.h"

namespace tenter::rig_system_test {
namespace {

using testing::HasSubstr;

constexpr const char* kPull = R"(schema_version = 1
name = "pull"
description = "two cords"
axes = ["axis-1", "axis-2"]
speed_m_per_s = 0.0015
capture_interval_s = 0.5
[[phase]]
name = "pull"
[[phase.step]]
end = "force"
force_N = 0.4
limit_m = 0.03
)";

/// The rig's file as somebody would have it who mixed up two amplifiers.
void cross(RunningRig& running) {
  const std::string file = running.rig().configFile().string();
  std::string toml = *readFile(file);
  const std::string first = "cell = \"cell-1\"", second = "cell = \"cell-2\"";
  const std::size_t at_first = toml.find(first), at_second = toml.find(second);
  toml.replace(at_first, first.size(), second);
  toml.replace(at_second, second.size(), first);
  ASSERT_TRUE(writeFileAtomically(file, toml).ok());
  running.restartDaemon();
}

TEST(MappingTest, CrossedCellsAreNamedAndRefuseTheRun) {
  RunningRig running;
  cross(running);
  const std::string protocol = running.write("pull.toml", kPull);
  const std::string session = running.path("session");
  EXPECT_EQ(running.tenterRig({"run", protocol, "-o", session}), 7);
  const std::string said = test_support::slurp(running.path("out"));
  EXPECT_THAT(said, HasSubstr("axis-1: cell-1 answers instead of cell-2"));
  EXPECT_THAT(said, HasSubstr("axis-2: cell-2 answers instead of cell-1"));
  EventLog log;
  ASSERT_TRUE(replaySession(session, {}, log).ok());
  EXPECT_THAT(log.text(), HasSubstr("\"fault\":\"mapping\""));
  EXPECT_THAT(log.text(), HasSubstr("\"name\":\"unloaded\""));
  EXPECT_THAT(log.text(), Not(HasSubstr("\"name\":\"capture\"")));
  EXPECT_TRUE(verifySession(session)->ok());

  ASSERT_EQ(running.tenterRig({"reset"}), 0);
  EXPECT_EQ(running.tenterRig({"check-mapping", "axis-3"}), 0) << "that one is right";
  // It may well end in a fault: with crossed cells a cord is let out by another's tension.
  (void)running.tenterRig({"run", protocol, "-o", running.path("skipped"), "--skip-mapping-check"});
  EventLog skipped;
  ASSERT_TRUE(replaySession(running.path("skipped"), {}, skipped).ok());
  EXPECT_THAT(skipped.text(), HasSubstr("\"name\":\"mapping-check-skipped\""));
  EXPECT_THAT(skipped.text(), HasSubstr("\"name\":\"capture\""));
}

}  // namespace
}  // namespace tenter::rig_system_test
