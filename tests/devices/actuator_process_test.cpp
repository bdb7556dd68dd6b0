// SPDX-License-Identifier: GPL-3.0-or-later
// Programs of their own on the virtual bus: a client that dies, and peers that are not ours.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <set>

#include "tenter/test_support/temporary_folder.h"
#include "virtual_rig.h"

namespace tenter::device_test {
namespace {

using test_support::slurp;
using testing::HasSubstr;

constexpr double kRestBound_s = 0.250;
constexpr int kTics = 7;  // and one LAC: eight devices
constexpr double kLacLead_units = 0.2 * 0.005 / kMetresPerCount;
constexpr const char* kPython = "/usr/bin/python3";  // Debian's, which has its modules

struct Client {
  explicit Client(VirtualUsb& bus) : usb(bus) {
    const Result<pid_t> started =
        usb.spawn({TENTER_DRIVE_AXES, std::to_string(kTics), "lac"}, folder / "out");
    if (started) pid = *started;
  }
  ~Client() { end(); }

  void end() {
    if (pid <= 0) return;
    kill(pid, SIGKILL);
    waitpid(pid, nullptr, 0);
    pid = 0;
  }
  bool allMove() const {
    for (int i = 0; i <= kTics; ++i) {
      if (usb.state(i).velocity_units_per_s == 0.0) return false;
    }
    return true;
  }
  bool waitForMotion() const {
    for (int i = 0; i < 300 && !allMove(); ++i) sleepFor(0.01);
    sleepFor(0.3);  // longer than any time-out: it is the client that keeps them going
    return allMove();
  }

  VirtualUsb& usb;
  test_support::TemporaryFolder folder;
  pid_t pid = 0;
};

std::unique_ptr<VirtualUsb> makeBus() {
  std::vector<VirtualActuatorSpec> specs = ticSpecs(kTics);
  specs.push_back(lacSpec());
  Result<std::unique_ptr<VirtualUsb>> usb = VirtualUsb::create(specs);
  if (!usb) ADD_FAILURE() << usb.error().message();
  return usb ? std::move(*usb) : nullptr;
}

class ClientGone : public testing::TestWithParam<int> {};

TEST_P(ClientGone, EveryAxisComesToRestByItself) {
  const std::unique_ptr<VirtualUsb> usb = makeBus();
  ASSERT_NE(usb, nullptr);
  Client client(*usb);
  ASSERT_TRUE(client.waitForMotion()) << slurp(client.folder / "out");
  const double lac_then = usb->state(kTics).position_units;
  const auto start = std::chrono::steady_clock::now();
  kill(client.pid, GetParam());
  std::vector<double> rest_s(kTics + 1, -1.0);
  while (secondsSince(start) < 0.5) {
    for (int i = 0; i <= kTics; ++i) {
      double& at_rest_s = rest_s[static_cast<std::size_t>(i)];
      const bool moves = usb->state(i).velocity_units_per_s != 0.0;
      if (moves) at_rest_s = -1.0;
      if (!moves && at_rest_s < 0.0) at_rest_s = secondsSince(start);
    }
    sleepFor(0.001);
  }
  double last_s = 0.0;
  for (const double s : rest_s) {
    EXPECT_GE(s, 0.0) << "an axis did not stop";
    EXPECT_LE(s, kRestBound_s);
    last_s = std::max(last_s, s);
  }
  std::printf("all axes at rest %.0f ms after signal %d\n", 1e3 * last_s, GetParam());
  EXPECT_LE(usb->state(kTics).position_units, lac_then + kLacLead_units + 1.0);
}

INSTANTIATE_TEST_SUITE_P(Signals, ClientGone, testing::Values(SIGKILL, SIGSTOP));

/// Foreign programs leak at their exit; a sanitizer that they inherit must not make that an error.
class ForeignPrograms : public testing::Test {
  void SetUp() override { setenv("ASAN_OPTIONS", "detect_leaks=0", 1); }
};

TEST_F(ForeignPrograms, ListTheDevices) {
  const std::unique_ptr<VirtualUsb> usb = makeBus();
  ASSERT_NE(usb, nullptr);
  const test_support::TemporaryFolder folder;
  const Result<int> code = usb->run({"lsusb"}, folder / "out");
  ASSERT_TRUE(code.ok()) << code.error().message();
  EXPECT_EQ(*code, 0);
  const std::string listing = slurp(folder / "out");
  for (const char* id : {"1ffb:00b3", "1ffb:00b5", "1ffb:00bd", "1ffb:00c3", "1ffb:00c9",
                         "1ffb:00cb", "04d8:fc5f"}) {
    EXPECT_THAT(listing, HasSubstr(id));
  }
}

TEST_F(ForeignPrograms, NeedTwoVariablesAndNothingElse) {
  const std::unique_ptr<VirtualUsb> usb = makeBus();
  ASSERT_NE(usb, nullptr);
  const test_support::TemporaryFolder folder;
  std::vector<std::string> command = {"env", "-i"};
  for (const std::string& variable : usb->environment()) command.push_back(variable);
  command.push_back("lsusb");
  const Result<int> code = usb->run(command, folder / "out");
  ASSERT_TRUE(code.ok()) << code.error().message();
  EXPECT_THAT(slurp(folder / "out"), HasSubstr("1ffb:00c9"));
}

TEST_F(ForeignPrograms, DriveThem) {
  const std::unique_ptr<VirtualUsb> usb = makeBus();
  ASSERT_NE(usb, nullptr);
  const test_support::TemporaryFolder folder;
  const Result<int> code =
      usb->run({kPython, std::string(TENTER_DEVICE_SCRIPTS) + "/peer.py"}, folder / "out");
  ASSERT_TRUE(code.ok()) << code.error().message();
  EXPECT_EQ(*code, 0) << slurp(folder / "out");
  EXPECT_NEAR(usb->state(0).position_units, 1100.0, 1.0);
  EXPECT_NEAR(usb->state(kTics).position_units, 310.0, 1.0);
}

TEST_F(ForeignPrograms, MissingOnesAreReported) {
  const std::unique_ptr<VirtualUsb> usb = makeBus();
  ASSERT_NE(usb, nullptr);
  const Result<int> code = usb->run({"there-is-no-such-program"});
  ASSERT_FALSE(code.ok());
  EXPECT_THAT(code.error().message(), HasSubstr("there-is-no-such-program"));
}

TEST(VirtualFaults, EachHasAName) {
  std::set<VirtualFault> faults;
  std::set<std::string_view> names;
  for (const VirtualFaultRow& row : virtualFaults()) {
    faults.insert(row.fault);
    names.insert(row.name);
  }
  const auto last = static_cast<std::size_t>(VirtualFault::kSettingsLocked);
  EXPECT_EQ(faults.size(), last + 1);
  EXPECT_EQ(names.size(), last + 1);
}

}  // namespace
}  // namespace tenter::device_test
