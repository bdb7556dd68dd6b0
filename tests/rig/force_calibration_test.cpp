// SPDX-License-Identifier: GPL-3.0-or-later
// Calibrations of force from the virtual rig, with the shipped programs: what they find is what it
// has.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <thread>

#include "running_rig.h"
#include "tenter/calib/cell_calibration.h"
#include "tenter/calib/cord_calibration.h"
#include "tenter/core/files.h"
#include "tenter/session/session_header.h"

namespace tenter::rig_system_test {
namespace {

using testing::HasSubstr;

/// In and out, the first cords at once and within the cap.
std::string loop(double way_m, int axes = ServedRig::kAxes) {
  std::string in, out;
  for (int axis = 1; axis <= axes; ++axis) {
    const std::string name = (axis > 1 ? ", axis-" : "axis-") + std::to_string(axis);
    in += name + " = " + std::to_string(way_m);
    out += name + " = 0.0";
  }
  return "schema_version = 1\nname = \"cord-loop\"\ndescription = \"every cord in and out\"\n"
         "axes = [\"axis-1\"]\nspeed_m_per_s = 0.0009\ncapture_interval_s = 1.0\n"
         "[[phase]]\nname = \"loop\"\n[[phase.step]]\nend = \"travel\"\ntargets_m = {" +
         in + "}\n[[phase.step]]\nend = \"travel\"\ntargets_m = {" + out + "}\n";
}

std::string record(RunningRig& running, double way_m, int axes = ServedRig::kAxes) {
  const std::string session = running.path("session");
  const std::string file = running.write("loop.toml", loop(way_m, axes));
  EXPECT_EQ(running.tenterRig({"run", file, "-o", session}), 0)
      << test_support::slurp(running.path("out"));
  return session;
}

int program(RunningRig& running, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), TENTER_PROGRAM);
  return *running.rig().usb().run(arguments, running.path("said"));
}

std::size_t promptsIn(const std::string& file) {
  const auto text = readFile(file);
  std::size_t count = 0;
  if (!text) return 0;
  for (auto at = text->find("press Enter"); at != std::string::npos;
       at = text->find("press Enter", at + 1)) {
    ++count;
  }
  return count;
}

TEST(CordCalibrationSystemTest, FindsTheFrictionOfTheVirtualPulleys) {
  MountOptions mount;
  mount.clips = "unhooked";
  RunningRig running(true, mount);
  const std::string session = record(running, 0.015), file = running.path("cords.json");
  ASSERT_EQ(program(running, {"calibrate", "cords", "--springs", session, "-o", file}), 0)
      << test_support::slurp(running.path("said"));
  const auto calibration = readCordCalibration(file);
  ASSERT_TRUE(calibration.ok()) << calibration.error().message();
  ASSERT_EQ(calibration->cords.size(), 8U);
  for (const CordEntry& cord : calibration->cords) {
    EXPECT_NEAR(cord.friction->friction_N, 0.05, 1e-3) << cord.axis;
    EXPECT_NEAR(cord.friction->presliding_m, 1e-4, 3e-5) << cord.axis;
    EXPECT_NEAR(cord.friction->spring_N_per_m, MountedSpecimen::kHook_N_per_m, 0.3) << cord.axis;
  }
  EXPECT_EQ(program(running, {"calibrate", "cords", "--springs", session, "-o", file,
                              "--max-residual-percent", "0.1"}),
            4)
      << "the cells' noise alone is more";
}

TEST(CordCalibrationSystemTest, FindsTheStretchOfTheVirtualCords) {
  MountOptions mount;
  mount.clips = "held";
  RunningRig running(true, mount);
  // Those that hold the sample. The others hang on springs: their cords run over the pulleys.
  constexpr int kHeld = 4;
  const std::string session = record(running, 0.007, kHeld), file = running.path("cords.json");
  ASSERT_EQ(program(running, {"calibrate", "cords", "--held", session, "-o", file}), 0)
      << test_support::slurp(running.path("said"));
  const auto calibration = readCordCalibration(file);
  ASSERT_TRUE(calibration.ok()) << calibration.error().message();
  ASSERT_EQ(calibration->cords.size(), std::size_t{kHeld});
  constexpr double kCord_N_per_m = 500.0;
  for (const char* axis : {"axis-1", "axis-2", "axis-3", "axis-4"}) {
    EXPECT_NEAR(calibration->find(axis)->stretch->stiffness_N_per_m, kCord_N_per_m, 25.0) << axis;
  }
}

TEST(CellCalibrationSystemTest, WeighsLiveAndTheRigThenGoesByIt) {
  constexpr double kGravity = 9.80665;
  MountOptions mount;
  mount.clips = "unhooked";
  RunningRig running(true, mount);
  ASSERT_EQ(running.tenterRig({"enable"}), 0);
  const std::string file = running.path("cells.json");
  int pipe_ends[2];
  ASSERT_EQ(pipe(pipe_ends), 0);
  const std::vector<double> weights_g{0.0, 50.0, 100.0, 50.0, 0.0};
  std::thread operator_at_the_bench([&] {
    // The amplifier of this cell says 3 % too much, and 20 mN of nothing.
    for (std::size_t i = 0; i < weights_g.size(); ++i) {
      EXPECT_TRUE(waitFor(30.0, [&] { return promptsIn(running.path("said")) > i; }));
      running.rig().addForce(0, 0.02 + 1.03 * 1e-3 * weights_g[i] * kGravity);
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      EXPECT_EQ(write(pipe_ends[1], "\n", 1), 1);
    }
    close(pipe_ends[1]);
  });
  const std::string command =
      std::string(TENTER_PROGRAM) + " calibrate cells --socket " + running.socket() +
      " --cell cell-1 --weights-g 0,50,100,50,0 --temperature-degc 21 "
      "--max-residual-percent 0.5 -o " +
      file + " < /proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(pipe_ends[0]);
  const int code = *running.rig().usb().run({"/bin/sh", "-c", command}, running.path("said"));
  operator_at_the_bench.join();
  close(pipe_ends[0]);
  ASSERT_EQ(code, 0) << test_support::slurp(running.path("said"));
  const auto calibration = readCellCalibration(file);
  ASSERT_TRUE(calibration.ok()) << calibration.error().message();
  const CellLine* line = calibration->find("cell-1");
  // Fifty readings with 3 mN each: 0.4 mN.
  EXPECT_NEAR(line->offset_N, 0.02, 2e-3);
  EXPECT_NEAR(line->gain, 1.0 / 1.03, 3e-3);

  // A rig's file names it; all cells have to be in it.
  const std::string config = running.rig().configFile().string();
  const std::string toml = *readFile(config);
  ASSERT_TRUE(writeFileAtomically(config, toml + "\n[calibration]\ncells = \"cells.json\"\n").ok());
  EXPECT_EQ(program(running,
                    {"protocol", "check", running.write("loop.toml", loop(0.01)), "--rig", config}),
            3);
  EXPECT_THAT(test_support::slurp(running.path("said")), HasSubstr("does not have cell-2"));
  std::vector<CellLoads> all;
  for (int cell = 1; cell <= ServedRig::kAxes; ++cell) {
    all.push_back({"cell-" + std::to_string(cell), line->loads});
  }
  CellCalibrationOptions options;
  options.max_residual_share = 0.005;
  const auto of_all = calibrateCells(all, options);
  ASSERT_TRUE(of_all.ok());
  ASSERT_TRUE(writeCellCalibration(file, *of_all).ok());
  running.restartDaemon();
  ASSERT_EQ(running.tenterRig({"enable"}), 0);
  running.rig().addForce(0, 0.02 + 1.03 * 0.9);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const nlohmann::json status = running.status();
  EXPECT_NEAR(status["cells"][0]["gross_N"].get<double>(), 0.9, 0.02);
  EXPECT_EQ(status["calibration_ids"]["cells"], of_all->id);
  running.rig().addForce(0, 0.0);
  const std::string session = record(running, 0.006);
  EXPECT_EQ(readSessionHeader(session)->calibration_ids.at("cells"), of_all->id);
}

}  // namespace
}  // namespace tenter::rig_system_test
