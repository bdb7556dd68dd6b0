// SPDX-License-Identifier: GPL-3.0-or-later
// The virtual cameras as users meet them: boards that calibrate, sessions that verify.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "program.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter::system_test {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

constexpr double kMaxHeldOut_px = 0.1, kMaxDistance_m = 0.02e-3;

TEST(TwinBoardsTest, TheRigIsCalibratedFromThem) {
  const TemporaryFolder folder;
  const Outcome boards =
      tenter({"twin", "capture", "--protocol", "stretch-weft", "--boards", "10", "--cameras", "2",
              "--image-width", "968", "--seed", "4", "-o", "B", "--truth", "T", "--json"},
             folder.path());
  ASSERT_EQ(boards.exit_code, 0) << boards.err;
  EXPECT_THAT(boards.json().at("calibrate").get<std::string>(), HasSubstr("--corners 11x8"));
  const Outcome calibrated = tenter({"calibrate",    "cameras",
                                     "--board",      "charuco",
                                     "--corners",    "11x8",
                                     "--square-mm",  "12",
                                     "--marker-mm",  "9",
                                     "--dictionary", "4x4_100",
                                     "--camera",     "cam-1",
                                     "--camera",     "cam-2",
                                     "--images",     "B/{camera}-{index:06}.png",
                                     "--rig-board",  "0",
                                     "-o",           "cal.json",
                                     "--json"},
                                    folder.path());
  ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err << calibrated.out;
  const auto answer = calibrated.json();
  EXPECT_LE(answer.at("held_out_rms_px").get<double>(), kMaxHeldOut_px);
  EXPECT_LE(answer.at("distance_rms_m").get<double>(), kMaxDistance_m);
  for (const auto& camera : answer.at("cameras")) EXPECT_GE(camera.at("accepted").get<int>(), 8);
  // Against the true cameras, by the distance between the two.
  std::ifstream truth_file(folder / "T/cameras.json"), known_file(folder / "cal.json");
  const auto truth = nlohmann::json::parse(truth_file), known = nlohmann::json::parse(known_file);
  const auto second = [](const nlohmann::json& calibration) {
    return calibration.at("cameras").at(1);
  };
  const auto place = [&](const nlohmann::json& calibration, int axis) -> double {
    return second(calibration).at("camera_from_world").at("translation_m").at(axis);
  };
  constexpr double kSigmas = 3.0, kWorstSigma_m = 0.6e-3;  // half a metre off, ten boards
  for (int axis = 0; axis < 3; ++axis) {
    const double sigma_m = second(known).at("translation_sigma_m").at(axis);
    EXPECT_LE(sigma_m, kWorstSigma_m);
    EXPECT_NEAR(place(known, axis), place(truth, axis), kSigmas * sigma_m);
  }
}

TEST(TwinImagesTest, ASessionWithImagesVerifies) {
  const TemporaryFolder folder;
  const std::vector<std::string> capture = {
      "twin",  "capture",   "--fabric", "knit-12", "--protocol", "bend-weft", "--seed",
      "3",     "--session", "--frames", "2",       "--nodes",    "17",        "--image-width",
      "320",   "--cameras", "2",        "-o",      "S",          "--truth",   "T",
      "--json"};
  const Outcome captured = tenter(capture, folder.path());
  ASSERT_EQ(captured.exit_code, 0) << captured.err;
  EXPECT_EQ(captured.json().at("frames"), 3);
  EXPECT_EQ(captured.json().at("cameras"), 2);
  const Outcome verified = tenter({"session", "verify", "S", "--json"}, folder.path());
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
  EXPECT_EQ(verified.json().at("frames"), 3);
  EXPECT_EQ(verified.json().at("ok"), true);
  // What is recorded is never replaced.
  EXPECT_NE(tenter(capture, folder.path()).exit_code, 0);
}

TEST(TwinImagesTest, OptionsThatCannotBeAreUsage) {
  const TemporaryFolder folder;
  const auto exitOf = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"twin", "capture", "--protocol", "shear", "-o", "S"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return tenter(arguments, folder.path()).exit_code;
  };
  EXPECT_EQ(exitOf({"--session"}), 2);  // no fabric
  EXPECT_EQ(exitOf({"--session", "--fabric", "knit-12", "--cameras", "1"}), 2);
  EXPECT_EQ(exitOf({"--session", "--fabric", "knit-12", "--image-width", "100"}), 2);
  EXPECT_EQ(exitOf({"--session", "--fabric", "knit-12", "--rays", "9"}), 2);
  EXPECT_EQ(exitOf({"--session", "--fabric", "knit-12", "--calibration-error-px", "50"}), 2);
  EXPECT_EQ(exitOf({"--boards", "2"}), 2);
  EXPECT_EQ(exitOf({"--session", "--boards", "10"}), 2);
  EXPECT_EQ(exitOf({"--session", "--fabric", "knit-12", "--calibration", "absent.json"}), 3);
  EXPECT_EQ(exitOf({"--session", "--fabric", "knit-12", "--truth", "S/truth"}), 2);
  EXPECT_FALSE(std::filesystem::exists(folder / "S"));
}

}  // namespace
}  // namespace tenter::system_test
