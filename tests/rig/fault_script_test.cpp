// SPDX-License-Identifier: GPL-3.0-or-later
// `tenter twin serve --fault` as a user types it, with the daemon on what it serves.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "running_rig.h"

extern char** environ;

namespace tenter::rig_system_test {
namespace {

using testing::HasSubstr;

constexpr const char* kScript = R"(schema_version = 1
[[fault]]
name = "gone"
device = "axis-2"
kind = "unplug"
at_s = 0.3
for_s = 0.3
[[fault]]
device = "cell-5"
kind = "silence"
after = "gone"
delay_s = [0.05, 0.1]
for_s = 0.2
)";

/// A program of its own: the test has no virtual bus.
pid_t start(const std::vector<std::string>& arguments, const std::string& output) {
  std::vector<std::string> copies = arguments;
  std::vector<char*> raw;
  for (std::string& copy : copies) raw.push_back(copy.data());
  raw.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 1, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&files, 1, 2);
  pid_t child = 0;
  if (posix_spawn(&child, raw.front(), &files, nullptr, raw.data(), environ) != 0) child = -1;
  posix_spawn_file_actions_destroy(&files);
  return child;
}

TEST(FaultScriptTest, IsPlayedAndLogged) {
  const test_support::TemporaryFolder folder;
  const std::string script = folder.write("faults.toml", kScript);
  const std::string log = folder / "state/faults.jsonl";
  const pid_t twin = start({TENTER_PROGRAM, "twin", "serve", "--fabric", "knit-12", "--state",
                            folder / "state", "--fault", script},
                           folder / "out");
  const auto lines = [&] {
    return std::filesystem::exists(log) ? test_support::slurp(log) : std::string();
  };
  EXPECT_TRUE(waitFor(20.0, [&] {
    const std::string text = lines();
    return std::count(text.begin(), text.end(), '\n') >= 4;
  }));
  kill(twin, SIGINT);
  EXPECT_EQ(RunningRig::wait(twin), 0);
  std::vector<nlohmann::json> events;
  std::istringstream text(lines());
  for (std::string line; std::getline(text, line);) events.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[0].at("device"), "axis-2");
  EXPECT_EQ(events[0].at("what"), "begins");
  EXPECT_NEAR(events[1].at("time_s").get<double>() - events[0].at("time_s").get<double>(), 0.3,
              0.2);
  EXPECT_EQ(events[2].at("kind"), "silence");
  EXPECT_EQ(events[3].at("what"), "ends");
  EXPECT_THAT(test_support::slurp(folder / "out"), HasSubstr("tenterd --config"));
}

TEST(FaultScriptTest, AnUnusableScriptEndsWithThreeBeforeAnythingIsServed) {
  const test_support::TemporaryFolder folder;
  for (const std::string& text :
       {std::string(
            "schema_version = 1\n[[fault]]\ndevice = \"axis-9\"\nkind = \"stall\"\nat_s = 1\n"),
        std::string("[["), std::string()}) {
    const std::string script = folder.write("faults.toml", text);
    const pid_t twin = start({TENTER_PROGRAM, "twin", "serve", "--fabric", "knit-12", "--state",
                              folder / "state", "--fault", script},
                             folder / "out");
    EXPECT_EQ(RunningRig::wait(twin), 3) << text;
    EXPECT_THAT(test_support::slurp(folder / "out"), HasSubstr("faults.toml"));
    EXPECT_FALSE(std::filesystem::exists(folder / "state"));
  }
}

}  // namespace
}  // namespace tenter::rig_system_test
