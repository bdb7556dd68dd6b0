// SPDX-License-Identifier: GPL-3.0-or-later
// The disk fills up while cords are drawn in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <filesystem>

#include "running_rig.h"
#include "tenter/session/replay.h"
#include "tenter/session/session_reader.h"

namespace tenter::rig_system_test {
namespace {

using testing::HasSubstr;

constexpr const char* kPull = R"(schema_version = 1
name = "pull"
description = "every axis moves for half a minute"
axes = ["axis-1"]
speed_m_per_s = 0.0009
capture_interval_s = 1.0
[[phase]]
name = "pull"
[[phase.step]]
end = "travel"
targets_m = {axis-1 = 0.03, axis-2 = 0.03, axis-3 = 0.03, axis-4 = 0.03}
)";

void limitFiles(pid_t daemon, rlim_t bytes) {
  rlimit limit{};
  ASSERT_EQ(prlimit(daemon, RLIMIT_FSIZE, nullptr, &limit), 0);
  limit.rlim_cur = bytes;
  ASSERT_EQ(prlimit(daemon, RLIMIT_FSIZE, &limit, nullptr), 0);
}

TEST(DiskFullTest, StopsUnloadsAndSaysSo) {
  constexpr double kDrawn_units = 2000.0;
  RunningRig running;
  const std::string session = running.path("session");
  const pid_t client =
      running.startTenterRig({"run", running.write("pull.toml", kPull), "-o", session});
  const auto drawn = [&] { return running.rig().usb().state(0).position_units; };
  ASSERT_TRUE(waitFor(40.0, [&] { return std::filesystem::exists(session); }));
  const double begun = drawn();
  ASSERT_TRUE(waitFor(20.0, [&] { return drawn() > begun + kDrawn_units; }));
  // A file that may not grow is to the daemon what a disk without room is.
  limitFiles(running.daemon(), std::filesystem::file_size(session + "/journal.jsonl"));
  const double at_limit = drawn();
  EXPECT_EQ(RunningRig::wait(client), 6);
  const std::string said = test_support::slurp(running.path("out"));
  EXPECT_THAT(said, HasSubstr("journal.jsonl"));
  limitFiles(running.daemon(), RLIM_INFINITY);
  EXPECT_LT(drawn(), at_limit) << "the cords were let out";
  const std::string log = test_support::slurp(running.log());
  EXPECT_THAT(log, HasSubstr("\"fault\":\"not-written\""));
  EXPECT_THAT(log, HasSubstr("\"name\":\"unloaded\""));
  const nlohmann::json status = running.status();
  EXPECT_EQ(status["state"], "fault");
  EXPECT_THAT(status["reason"].get<std::string>(), HasSubstr("not-written"));
  const auto report = verifySession(session);
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(report->ok()) << "what was recorded is whole";
}

}  // namespace
}  // namespace tenter::rig_system_test
