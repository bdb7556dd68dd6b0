// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/rig_cameras.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "capture_support.h"
#include "tenter/test_support/temporary_folder.h"
#include "tenter/twin/protocol.h"
#include "tenter/twin/rig_mounting.h"

namespace tenter {
namespace {

TEST(RigMountingTest, IsValidForEveryProtocolAndHasACellForEachCord) {
  for (const ProtocolInfo& protocol : protocols()) {
    const Mounting m = rigMounting("denim-14", std::string(protocol.id)).value();
    EXPECT_TRUE(validateMounting(m).ok()) << protocol.id;
    EXPECT_EQ(m.cords.empty(), !protocol.has_cords);
    EXPECT_EQ(m.table.has_value(), !protocol.has_cords);
    for (std::size_t i = 0; i < m.cords.size(); ++i) {
      EXPECT_EQ(m.cords[i].cell, static_cast<int>(i));
      ASSERT_NE(m.findClip(m.cords[i].clip), nullptr);
      EXPECT_GE(m.findClip(m.cords[i].clip)->tags.size(), 3U) << protocol.id;
    }
  }
  EXPECT_FALSE(rigMounting("felt-99", "shear").ok());
  EXPECT_FALSE(rigMounting("knit-12", "juggle").ok());
}

TEST(RigMountingTest, AgreesWithTheCapture) {
  for (const char* protocol : {"shear", "corner-pull"}) {
    const CaptureResult run = captured(smallCapture("knit-12", protocol));
    const Mounting m = rigMounting("knit-12", protocol).value();
    const MeasurementFrame& frame = run.truth.exact.frames.back();
    ASSERT_EQ(frame.clips.size(), m.clips.size());
    for (std::size_t c = 0; c < m.clips.size(); ++c) {
      EXPECT_EQ(frame.clips[c].clip, m.clips[c].id);
      ASSERT_EQ(frame.clips[c].outline_uv_m.size(), m.clips[c].outline_uv_m.size());
      for (std::size_t i = 0; i < m.clips[c].outline_uv_m.size(); ++i) {
        EXPECT_NEAR((frame.clips[c].outline_uv_m[i] - m.clips[c].outline_uv_m[i]).norm(), 0.0,
                    1e-12);
      }
    }
    for (const CordReading& reading : frame.cords) {
      const auto cord = std::find_if(m.cords.begin(), m.cords.end(), [&](const MountedCord& known) {
        return known.cord == reading.cord;
      });
      ASSERT_NE(cord, m.cords.end()) << reading.cord;
      EXPECT_EQ(cord->attachment_m, reading.attachment_m);
      for (const ClipReading& clip : frame.clips) {
        if (clip.clip != cord->clip) continue;
        const Vec3 way = *cord->pulley_m - clip.rig_from_clip * cord->attachment_m;
        EXPECT_NEAR((way.normalized() - reading.direction).norm(), 0.0, 1e-9);
      }
    }
  }
}

TEST(RigCamerasTest, AllOfThemSeeTheSampleAtRestOrWhereItHangs) {
  for (const ProtocolInfo& protocol : protocols()) {
    const auto cameras = rigCameras({std::string(protocol.id), 4, 1936, 7});
    for (const VirtualCamera& camera : cameras.value()) {
      // What lies on a table is not looked at, only what has been pushed out.
      const Vec3 middle_m = rigFocus(protocol.id);
      const double reach_m = protocol.has_cords ? 0.05 : 0.03;
      for (const Vec3& corner : {Vec3(-1.0, -1.0, 0.0), Vec3(1.0, -1.0, 0.0), Vec3(-1.0, 1.0, 0.0),
                                 Vec3(1.0, 1.0, 0.0)}) {
        const auto pixel =
            camera.model.project(camera.camera_from_rig * (middle_m + reach_m * corner));
        ASSERT_TRUE(pixel.has_value());
        EXPECT_TRUE(camera.model.contains(*pixel)) << protocol.id << " " << camera.name;
      }
      const Vec3 middle = camera.camera_from_rig * rigFocus(protocol.id);
      const double scale_m = middle.z() / camera.model.lens().fx_px;
      EXPECT_GT(scale_m, 0.10e-3);
      EXPECT_LT(scale_m, 0.16e-3);
    }
  }
}

TEST(RigCamerasTest, RefusesWhatThereIsNot) {
  EXPECT_FALSE(rigCameras({"juggle", 4, 1936, 1}).ok());
  EXPECT_FALSE(rigCameras({"shear", 1, 1936, 1}).ok());
  EXPECT_FALSE(rigCameras({"shear", 4, 100, 1}).ok());
}

/// Root mean square distance of the two projections over the sample, one camera.
double missBy(const VirtualCamera& truth, const CalibratedCamera& known,
              const Eigen::Isometry3d& world_from_rig) {
  double squares = 0.0;
  int places = 0;
  for (double x = 0.0; x < 0.11; x += 0.02) {
    for (double y = 0.0; y < 0.11; y += 0.02) {
      for (double z = -0.05; z < 0.06; z += 0.025, ++places) {
        const Vec3 place(x, y, z);
        const auto a = truth.model.project(truth.camera_from_rig * place);
        const auto b = known.model.project(known.camera_from_world * (world_from_rig * place));
        squares += (*a - *b).squaredNorm();
      }
    }
  }
  return std::sqrt(squares / places);
}

TEST(CalibrationOfTest, ErrsByWhatItIsAskedFor) {
  const auto cameras = rigCameras({"shear", 4, 1936, 5}).value();
  const Vec3 focus = rigFocus("shear");
  for (const double error_px : {0.0, 0.02, 0.3}) {
    const CameraCalibration c = calibrationOf(cameras, focus, error_px, 5);
    const Eigen::Isometry3d world_from_rig = c.rig->rig_from_world.inverse();
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      // Other places than those it was scaled at.
      EXPECT_NEAR(missBy(cameras[i], c.cameras[i], world_from_rig), error_px,
                  0.1 * error_px + 1e-9);
    }
    EXPECT_NEAR(
        (c.rig->rig_from_world.linear() * c.rig->gravity_world_m_per_s2 - kDefaultGravity).norm(),
        0.0, 1e-9);
  }
  const test_support::TemporaryFolder folder;
  const CameraCalibration written = calibrationOf(cameras, focus, 0.02, 5);
  ASSERT_TRUE(writeCalibration(folder / "c.json", written).ok());
  EXPECT_EQ(readCalibration(folder / "c.json").value().cameras.size(), 4U);
}

/// Squares of a pose's six errors over their stated variances, from the row of the first.
double normalised(const Eigen::Isometry3d& is, const Eigen::Isometry3d& was,
                  const Eigen::MatrixXd& covariance, Eigen::Index row) {
  const Eigen::AngleAxisd turn(Mat3(is.linear() * was.linear().transpose()));
  Eigen::Matrix<double, 6, 1> error;
  error << turn.angle() * turn.axis(), is.translation() - was.translation();
  return error.dot(covariance.block<6, 6>(row, row).ldlt().solve(error));
}

TEST(CalibrationOfTest, StatesHowItErrs) {
  const auto cameras = rigCameras({"shear", 3, 1936, 5}).value();
  const Vec3 focus = rigFocus("shear");
  const CameraCalibration exact = calibrationOf(cameras, focus, 0.0, 1);
  ASSERT_EQ(exact.parameters.size(), 3U * 9U + 3U * 6U);
  EXPECT_EQ(exact.parameters.back(), "rig.translation_m[2]");
  EXPECT_EQ(exact.covariance.norm(), 0.0);
  double sum = 0.0;
  constexpr int kSeeds = 60;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const CameraCalibration c =
        calibrationOf(cameras, focus, 0.02, static_cast<std::uint64_t>(seed));
    // Rows: nine of the first lens, then nine and six of each, the rig's last.
    sum += normalised(c.rig->rig_from_world.inverse(), exact.rig->rig_from_world.inverse(),
                      c.covariance, 39);
    for (int i = 1; i < 3; ++i)
      sum += normalised(c.cameras[i].camera_from_world, exact.cameras[i].camera_from_world,
                        c.covariance, 15 * i + 3);
  }
  // Chi-squared: its mean over 1080 numbers scatters by 4 %.
  EXPECT_NEAR(sum / (18.0 * kSeeds), 1.0, 0.15);
}

}  // namespace
}  // namespace tenter
