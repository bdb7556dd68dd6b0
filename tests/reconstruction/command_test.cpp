// SPDX-License-Identifier: GPL-3.0-or-later
// `tenter reconstruct --images …` as users type it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "program.h"
#include "tenter/core/measurement.h"
#include "tenter/test_support/temporary_folder.h"
#include "wrinkled_sheet.h"

namespace tenter::system_test {
namespace {

using namespace reconstruction_test;
using test_support::TemporaryFolder;
using testing::Contains;
using testing::HasSubstr;

constexpr double kPixel_m = 0.25e-3;
constexpr int kWidth = 260, kHeight = 240;
const Vec2 kSheet_m(0.05, 0.05);
/// In space, over all valid vertices [m RMS].
constexpr double kPlaceTolerance_m = 0.05e-3;

std::vector<CameraView> twoCameras() {
  const double tilt = 15.0 * std::numbers::pi / 180.0;
  return {cameraAt("left", 0.0, tilt, kPixel_m, kWidth, kHeight),
          cameraAt("right", std::numbers::pi, tilt, kPixel_m, kWidth, kHeight)};
}

/// A sheet around the cameras' common point that bulges and moves as frames go by.
Surface sheetAt(int frame) {
  return [frame](const Vec2& uv) -> Vec3 {
    const Vec2 place = uv + Vec2(0.025, 0.025);
    const double bulge = 0.4e-3 * frame * wave(uv.x(), 0.05);
    return {place.x() + 0.3e-3 * frame, place.y() - 0.2e-3 * frame, bulge};
  };
}

void writeTiff(const std::filesystem::path& file, const GrayImage& image) {
  cv::Mat pixels(image.height, image.width, CV_8U);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      pixels.at<uchar>(y, x) = cv::saturate_cast<uchar>(image.at(x, y));
    }
  }
  ASSERT_TRUE(cv::imwrite(file.string(), pixels));
}

class ReconstructCommand : public testing::Test {
 protected:
  void SetUp() override {
    CameraCalibration calibration;
    calibration.source = "test";
    for (const CameraView& view : twoCameras()) {
      calibration.cameras.push_back({view.name, view.model, view.camera_from_space});
    }
    // The world of a calibration is its first camera's frame.
    const Eigen::Isometry3d space_from_world = calibration.cameras[0].camera_from_world.inverse();
    for (CalibratedCamera& camera : calibration.cameras) {
      camera.camera_from_world = camera.camera_from_world * space_from_world;
    }
    world_from_space_ = space_from_world.inverse();
    ASSERT_TRUE(writeCalibration(folder_ / "cal.json", calibration).ok());
    const SpeckleTexture texture(3);
    for (int frame = 0; frame < 3; ++frame) {
      for (const CameraView& view : twoCameras()) {
        const Scene scene{sheetAt(frame), kSheet_m};
        writeTiff(folder_ / (view.name + "_000" + std::to_string(frame) + ".tif"),
                  photograph(scene, view, texture, 10U * static_cast<unsigned>(frame)));
      }
    }
  }

  Outcome run(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"reconstruct",
                                          "--images",
                                          "{camera}_{frame:04}.tif",
                                          "--calibration",
                                          "cal.json",
                                          "-o",
                                          "m",
                                          "--json",
                                          "--vertices",
                                          "30"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return tenter(arguments, folder_.path());
  }

  TemporaryFolder folder_;
  Eigen::Isometry3d world_from_space_;
};

TEST_F(ReconstructCommand, MeasuresShapeAndDisplacement) {
  const Outcome outcome = run({"--report", "page.html"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto answer = outcome.json();
  EXPECT_EQ(answer.at("frames"), 3);
  EXPECT_GT(answer.at("vertices").get<int>(), 300);
  EXPECT_GT(answer.at("valid_fraction").get<double>(), 0.97);
  EXPECT_LT(answer.at("sigma_median_m").get<double>(), kPlaceTolerance_m);
  EXPECT_THAT(test_support::slurp(folder_ / "page.html"), HasSubstr("Drift check"));
  const auto m = readMeasurement(folder_ / "m");
  ASSERT_TRUE(m.ok()) << m.error().message();
  const Eigen::Isometry3d space_from_world = world_from_space_.inverse();
  for (int frame = 0; frame < 3; ++frame) {
    double squares = 0.0, count = 0.0;
    for (int i = 0; i < m->rest->vertexCount(); ++i) {
      const MeasurementFrame& seen = m->frames[static_cast<std::size_t>(frame)];
      if (seen.valid[static_cast<std::size_t>(i)] == 0) continue;
      // At rest the sheet is flat: places there are material points.
      const Vec3 rest = space_from_world * Vec3(m->rest->positions.col(i));
      const Vec3 truth = sheetAt(frame)(rest.head<2>() - Vec2(0.025, 0.025));
      squares += (space_from_world * Vec3(seen.positions.col(i)) - truth).squaredNorm();
      count += 1.0;
    }
    EXPECT_LT(std::sqrt(squares / count), kPlaceTolerance_m) << frame;
  }
}

TEST_F(ReconstructCommand, NamesACameraThatIsMissing) {
  std::filesystem::remove(folder_ / "right_0001.tif");
  const Outcome outcome = run();
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.json().at("warnings"), Contains(testing::Eq("frame 1: no image of right")));
  const auto m = readMeasurement(folder_ / "m");
  ASSERT_TRUE(m.ok());
  EXPECT_EQ(m->frames[1].positions.cols(), 0);
  EXPECT_GT(m->frames[2].positions.cols(), 0);
}

TEST_F(ReconstructCommand, RefusesImagesOfAnotherSize) {
  writeTiff(folder_ / "left_0000.tif", GrayImage(kWidth - 2, kHeight));
  const Outcome outcome = run();
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.json().at("error").at("file").get<std::string>(), HasSubstr("left_0000.tif"));
  EXPECT_THAT(outcome.err, HasSubstr("calibrated with 260 x 240"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "m"));
}

TEST_F(ReconstructCommand, AsksForWhatItNeeds) {
  EXPECT_EQ(tenter({"reconstruct", "-o", "m"}, folder_.path()).exit_code, 2);
  EXPECT_EQ(run({"--camera", "left"}).exit_code, 2);
  EXPECT_EQ(run({"--roi", "1,2,3"}).exit_code, 2);
  EXPECT_EQ(tenter({"reconstruct", "nowhere", "-o", "m"}, folder_.path()).exit_code, 3);
}

}  // namespace
}  // namespace tenter::system_test
