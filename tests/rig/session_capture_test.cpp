// SPDX-License-Identifier: GPL-3.0-or-later
// `tenter twin capture --session --through-daemon`, with what it starts and what it leaves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "running_rig.h"
#include "tenter/core/files.h"
#include "tenter/session/replay.h"
#include "tenter/session/session_reader.h"

namespace tenter::rig_system_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A capture whose state folder lies below `folder`.
pid_t startCapture(const std::string& folder, const std::vector<std::string>& arguments) {
  std::vector<std::string> all{TENTER_PROGRAM, "twin", "capture", "--session", "--through-daemon"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> raw;
  for (std::string& argument : all) raw.push_back(argument.data());
  raw.push_back(nullptr);
  const pid_t child = fork();
  if (child != 0) return child;
  setenv("TMPDIR", folder.c_str(), 1);
  execv(raw.front(), raw.data());
  _exit(127);
}

bool programWith(const std::string& argument) {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    // Not readFile(): what /proc holds says that it is empty.
    std::ifstream file(entry.path() / "cmdline", std::ios::binary);
    const std::string line((std::istreambuf_iterator<char>(file)),
                           std::istreambuf_iterator<char>());
    if (line.find(argument) != std::string::npos) return true;
  }
  return false;
}

bool leftovers(const std::string& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with("tenter-rig-")) return true;
  }
  return false;
}

bool waitForSamples(const std::string& session, std::uint64_t samples) {
  return waitFor(30.0, [&] {
    const auto report = inspectSession(session);
    return report.ok() && report->samples >= samples;
  });
}

/// A capture that has recorded so much. The daemon rightly refuses to move what a machine full of
/// other work keeps from answering; that is tried again.
pid_t runningCapture(const test_support::TemporaryFolder& folder,
                     const std::vector<std::string>& arguments, std::uint64_t samples) {
  constexpr int kTrials = 3;
  for (int trial = 0; trial < kTrials; ++trial) {
    const pid_t capture = startCapture(folder.path(), arguments);
    if (waitForSamples(folder / "session", samples)) return capture;
    kill(capture, SIGTERM);
    RunningRig::wait(capture);
    fs::remove_all(folder / "session");
  }
  throw std::runtime_error("no session begins");
}

TEST(SessionCaptureTest, CtrlCUnloadsClosesTheSessionAndEndsEverything) {
  const test_support::TemporaryFolder folder;
  const std::string session = folder / "session", truth = folder / "truth";
  const pid_t capture = runningCapture(folder,
                                       {"--fabric", "knit-12", "--protocol", "stretch-weft",
                                        "--seed", "5521", "-o", session, "--truth", truth},
                                       150);
  EXPECT_TRUE(programWith(folder.path().string() + "/tenter-rig-"));
  kill(capture, SIGINT);
  EXPECT_EQ(RunningRig::wait(capture), 7);
  const auto report = verifySession(session);
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(report->ok());
  EXPECT_TRUE(report->closed);
  EventLog log;
  ASSERT_TRUE(replaySession(session, {}, log).ok());
  EXPECT_THAT(log.text(), HasSubstr("\"how\":\"aborted\""));
  EXPECT_THAT(log.text(), HasSubstr("\"name\":\"unloaded\""));
  EXPECT_FALSE(programWith(folder.path().string() + "/tenter-rig-"));
  EXPECT_FALSE(leftovers(folder.path()));
  EXPECT_TRUE(fs::exists(fs::path(truth) / "truth.jsonl"));
}

TEST(SessionCaptureTest, TheDaemonEndsWithACaptureThatIsKilled) {
  const test_support::TemporaryFolder folder;
  const std::string session = folder / "session";
  const pid_t capture = runningCapture(
      folder, {"--fabric", "knit-12", "--protocol", "stretch-weft", "-o", session}, 50);
  kill(capture, SIGKILL);
  EXPECT_EQ(RunningRig::wait(capture), 128 + SIGKILL);
  EXPECT_TRUE(waitFor(40.0, [&] { return !programWith(folder.path().string() + "/tenter-rig-"); }));
  EXPECT_TRUE(verifySession(session)->ok());
}

TEST(SessionCaptureTest, RefusesBeforeAnythingStarts) {
  const test_support::TemporaryFolder folder;
  folder.write("old/session.json", "{}");
  EXPECT_EQ(RunningRig::wait(startCapture(folder.path(), {"--fabric", "knit-12", "--protocol",
                                                          "shear", "-o", folder / "old"})),
            3);
  EXPECT_EQ(RunningRig::wait(startCapture(
                folder.path(), {"--fabric", "felt", "--protocol", "shear", "-o", folder / "new"})),
            2);
  EXPECT_FALSE(fs::exists(folder / "new"));
  EXPECT_FALSE(leftovers(folder.path()));
}

}  // namespace
}  // namespace tenter::rig_system_test
