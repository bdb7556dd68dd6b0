// SPDX-License-Identifier: GPL-3.0-or-later
// Somebody sets the clock, again and again, while the rig runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "running_rig.h"
#include "tenter/rig/redecide.h"
#include "tenter/session/session_reader.h"

namespace tenter::rig_system_test {
namespace {

using testing::HasSubstr;

constexpr const char* kHold = R"(schema_version = 1
name = "hold"
description = "two axes move and wait"
axes = ["axis-1", "axis-2"]
speed_m_per_s = 0.002
capture_interval_s = 0.5
[[phase]]
name = "hold"
[[phase.step]]
end = "travel"
targets_m = {axis-1 = 0.004, axis-2 = 0.004}
[[phase.step]]
end = "hold"
hold_s = 3.0
)";

TEST(ClockStepTest, NothingThatTheRigDoesGoesByTheWallClock) {
  RunningRig running;
  running.restartDaemon(TENTER_CLOCK_JUMP);
  const std::string session = running.path("session");
  ASSERT_EQ(running.tenterRig({"run", running.write("hold.toml", kHold), "-o", session}), 0)
      << test_support::slurp(running.path("out"));
  const auto report = verifySession(session);
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(report->ok());
  EXPECT_TRUE(report->closed);
  // Two seconds of way, three of waiting, unloading; an hour would show.
  EXPECT_GT(report->duration_ns, 5'000'000'000);
  EXPECT_LT(report->duration_ns, 60'000'000'000);
  Redecider redecider;
  ASSERT_TRUE(replaySession(session, {}, redecider).ok());
  EXPECT_TRUE(redecider.identical());
  EXPECT_THAT(redecider.text(), Not(HasSubstr("late-tick")));
  EXPECT_THAT(redecider.text(), Not(HasSubstr("stale")));
  EXPECT_THAT(redecider.text(), Not(HasSubstr("lease-lost")));

  // The log's stamps are of the wall clock: that it jumped at all is to be seen there.
  std::istringstream log(test_support::slurp(running.log()));
  std::vector<std::string> hours;
  for (std::string line; std::getline(log, line);) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (json.is_object()) hours.push_back(json.value("time", "").substr(0, 13));
  }
  EXPECT_FALSE(std::is_sorted(hours.begin(), hours.end())) << "the clock was not set";
}

}  // namespace
}  // namespace tenter::rig_system_test
