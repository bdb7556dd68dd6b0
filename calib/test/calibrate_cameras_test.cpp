// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/calibrate_cameras.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "camera_graph.h"
#include "virtual_rig.h"

namespace tenter {
namespace {

using testing::HasSubstr;
using virtual_rig::boardPoses;
using virtual_rig::photograph;

constexpr unsigned kSeed = 3;
/// What corner detection leaves on clean images.
constexpr double kNoise_px = 0.04;

struct Scene {
  Board board = virtual_rig::chessboard();
  std::vector<virtual_rig::Camera> cameras;
  std::vector<CameraPhotos> photos;
};

Scene scene(int cameras, int sets, double noise_px = kNoise_px, double tilt_rad = 0.7) {
  Scene s;
  std::mt19937_64 random(kSeed);
  s.cameras = virtual_rig::cameras(cameras);
  const auto poses = boardPoses(s.board, sets, random, tilt_rad);
  s.photos = photograph(s.board, s.cameras, poses, noise_px, random);
  return s;
}

double angleBetween(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(Mat3(a.linear() * b.linear().transpose())).angle();
}

TEST(CalibrateCamerasTest, RecoversTheTruthFromExactCorners) {
  Scene s = scene(2, 8, 0.0);
  const auto c = calibrateCameras(s.board, s.photos, {});
  ASSERT_TRUE(c.ok()) << c.error().message();
  EXPECT_TRUE(c->accepted) << testing::PrintToString(c->reasons);
  for (int i = 0; i < 2; ++i) {
    const Lens& lens = c->cameras[i].model.lens();
    EXPECT_NEAR(lens.fx_px, s.cameras[i].lens[0], 1e-3);
    EXPECT_NEAR(lens.cy_px, s.cameras[i].lens[3], 1e-3);
    EXPECT_NEAR(lens.distortion[0], s.cameras[i].lens[4], 1e-5);
    EXPECT_LT(*c->cameras[i].rms_px, 1e-4);
  }
  EXPECT_LT(angleBetween(c->cameras[1].camera_from_world, s.cameras[1].camera_from_world), 1e-6);
  EXPECT_NEAR(
      (c->cameras[1].camera_from_world.translation() - s.cameras[1].camera_from_world.translation())
          .norm(),
      0.0, 1e-6);
}

TEST(CalibrateCamerasTest, HeldOutBoardsAndKnownDistancesAreWithinTheLimits) {
  Scene s = scene(4, 15);
  const auto c = calibrateCameras(s.board, s.photos, {});
  ASSERT_TRUE(c.ok()) << c.error().message();
  EXPECT_TRUE(c->accepted) << testing::PrintToString(c->reasons);
  EXPECT_LT(*c->quality.held_out_rms_px, 0.1);
  EXPECT_LT(*c->quality.distance_rms_m, 2e-5);
  EXPECT_LT(*c->quality.epipolar_rms_px, 0.1);
  EXPECT_NEAR(*c->quality.noise_px, kNoise_px, 0.1 * kNoise_px);
  // Within four of its own standard deviations.
  for (int i = 1; i < 4; ++i) {
    const Vec3 error = c->cameras[i].camera_from_world.translation() -
                       s.cameras[i].camera_from_world.translation();
    EXPECT_LT((error.cwiseAbs() - 4.0 * c->cameras[i].translation_sigma_m).maxCoeff(), 0.0);
  }
  EXPECT_EQ(c->parameters.size(), 4u * 9u + 3u * 6u + 2u);
  EXPECT_EQ(c->covariance.rows(), 56);
}

TEST(CalibrateCamerasTest, FitsTheWarpOfABoard) {
  Scene s = scene(2, 1);
  std::mt19937_64 random(kSeed);
  const Vec2 warp(4e-4, -2.5e-4);
  const auto poses = boardPoses(s.board, 15, random);
  s.photos = photograph(s.board, s.cameras, poses, kNoise_px, random, warp);
  const auto warped = calibrateCameras(s.board, s.photos, {});
  ASSERT_TRUE(warped.ok()) << warped.error().message();
  EXPECT_NEAR((*warped->warp_m - warp).norm(), 0.0, 4.0 * warped->warp_sigma_m->norm());
  CameraCalibrationOptions flat;
  flat.fit_warp = false;
  const auto unwarped = calibrateCameras(s.board, s.photos, flat);
  ASSERT_TRUE(unwarped.ok());
  EXPECT_FALSE(unwarped->warp_m.has_value());
  EXPECT_GT(*unwarped->quality.rms_px, 1.2 * *warped->quality.rms_px);
}

TEST(CalibrateCamerasTest, NamesTheImageWhoseCornersAreWrong) {
  Scene s = scene(1, 10);
  // Another grid was taken for the board.
  s.photos[0].photos[4].corners.pixels.row(0).array() *= 1.02;
  s.photos[0].photos[4].corners.pixels(1, 7) += 30.0;
  const auto c = calibrateCameras(s.board, s.photos, {});
  ASSERT_TRUE(c.ok()) << c.error().message();
  EXPECT_TRUE(c->accepted);
  EXPECT_EQ(c->cameras[0].used.size(), 9u);
  ASSERT_EQ(c->cameras[0].rejected.size(), 1u);
  EXPECT_EQ(c->cameras[0].rejected[0].image, "c0-4.png");
  EXPECT_THAT(c->cameras[0].rejected[0].reason, HasSubstr("miss the model by"));
  EXPECT_LT(*c->quality.rms_px, 2.0 * kNoise_px);
}

TEST(CalibrateCamerasTest, NamesTheSetInWhichTheBoardMoved) {
  Scene s = scene(2, 10);
  std::mt19937_64 random(kSeed + 1);
  const auto elsewhere = boardPoses(s.board, 1, random);
  auto moved = photograph(s.board, {s.cameras[1]}, elsewhere, kNoise_px, random);
  s.photos[1].photos[6].corners = moved[0].photos[0].corners;
  const auto c = calibrateCameras(s.board, s.photos, {});
  ASSERT_TRUE(c.ok()) << c.error().message();
  EXPECT_TRUE(c->accepted);
  EXPECT_LT(*c->quality.rms_px, 2.0 * kNoise_px);
  std::vector<RejectedImage> rejected = c->cameras[0].rejected;
  rejected.insert(rejected.end(), c->cameras[1].rejected.begin(), c->cameras[1].rejected.end());
  ASSERT_FALSE(rejected.empty());
  for (const RejectedImage& image : rejected) {
    EXPECT_THAT(image.image, HasSubstr("-6.png"));
    EXPECT_THAT(image.reason, HasSubstr("does not agree with the other cameras"));
  }
}

TEST(CalibrateCamerasTest, CamerasMayMissSetsAndBeLinkedThroughOthers) {
  Scene s = scene(3, 14);
  // The last camera never sees a board together with the first.
  auto& first = s.photos[0].photos;
  auto& last = s.photos[2].photos;
  first.erase(first.begin() + 8, first.end());
  last.erase(last.begin(), last.begin() + 8);
  s.photos[1].photos.erase(s.photos[1].photos.begin() + 2);
  const auto c = calibrateCameras(s.board, s.photos, {});
  ASSERT_TRUE(c.ok()) << c.error().message();
  EXPECT_TRUE(c->accepted) << testing::PrintToString(c->reasons);
  EXPECT_LT(angleBetween(c->cameras[2].camera_from_world, s.cameras[2].camera_from_world), 2e-3);
}

TEST(CalibrateCamerasTest, BoardsBeginAtEitherEnd) {
  Scene s = scene(2, 10);
  const BoardTurn half_turn = boardTurns(s.board).at(1);
  for (const int set : {1, 2, 5, 7}) {
    Points2& pixels = s.photos[set % 2].photos[set].corners.pixels;
    const Points2 before = pixels;
    for (int i = 0; i < s.board.cornerCount(); ++i) pixels.col(i) = before.col(half_turn.id[i]);
  }
  const auto c = calibrateCameras(s.board, s.photos, {});
  ASSERT_TRUE(c.ok()) << c.error().message();
  EXPECT_TRUE(c->accepted);
  EXPECT_EQ(c->cameras[0].used.size() + c->cameras[1].used.size(), 20u);
  EXPECT_LT(angleBetween(c->cameras[1].camera_from_world, s.cameras[1].camera_from_world), 2e-3);
}

TEST(CalibrateCamerasTest, RejectsWhatItCannotKnow) {
  // Boards almost head on do not tell the focal length from the distance.
  Scene head_on = scene(1, 8, 0.2, 0.01);
  const auto c = calibrateCameras(head_on.board, head_on.photos, {});
  ASSERT_TRUE(c.ok()) << c.error().message();
  EXPECT_FALSE(c->accepted);
  EXPECT_THAT(c->reasons.at(0), HasSubstr("c0: its focal length"));

  Scene noisy = scene(1, 8, 1.0);
  const auto blurred = calibrateCameras(noisy.board, noisy.photos, {});
  ASSERT_TRUE(blurred.ok());
  EXPECT_FALSE(blurred->accepted);
  EXPECT_THAT(blurred->reasons.at(0), HasSubstr("more than 0.50 px"));
}

TEST(CalibrateCamerasTest, NeedsThreeImagesAndACommonSet) {
  Scene few = scene(2, 2);
  std::vector<std::vector<RejectedImage>> left_out;
  const auto c = calibrateCameras(few.board, few.photos, {}, &left_out);
  ASSERT_FALSE(c.ok());
  EXPECT_EQ(c.error().kind, ErrorKind::kCalibrationRejected);
  EXPECT_THAT(c.error().message(), HasSubstr("c0: has 2 usable images"));
  EXPECT_EQ(left_out.size(), 2u);

  Scene apart = scene(2, 8);
  for (BoardPhoto& photo : apart.photos[1].photos) photo.index += 100;
  const auto unlinked = calibrateCameras(apart.board, apart.photos, {});
  ASSERT_FALSE(unlinked.ok());
  EXPECT_EQ(unlinked.error().kind, ErrorKind::kCalibrationRejected);
  EXPECT_THAT(unlinked.error().message(), HasSubstr("c1: never sees the board at the same time"));
}

TEST(CalibrateCamerasTest, ABoardInTheRigsPlaneGivesItsAxes) {
  Scene s = scene(2, 8, 0.0);
  CameraCalibrationOptions options;
  options.rig_index = 3;
  const auto c = calibrateCameras(s.board, s.photos, options);
  ASSERT_TRUE(c.ok()) << c.error().message();
  ASSERT_TRUE(c->rig.has_value());
  // Of the truth: the same set's board, its middle the origin, z out of the print.
  std::mt19937_64 random(kSeed);
  const auto pose = boardPoses(s.board, 8, random)[3];
  const Vec3 middle = pose * Vec3(s.board.cornerPositions().rowwise().mean());
  EXPECT_LT((c->rig->rig_from_world * middle).norm(), 1e-5);
  const Vec3 next = pose * Vec3(s.board.cornerPositions().rowwise().mean() + Vec3(0.1, 0.0, 0.0));
  EXPECT_NEAR((c->rig->rig_from_world * next - Vec3(0.1, 0.0, 0.0)).norm(), 0.0, 1e-5);
  const Vec3 into_print = pose.linear() * Vec3::UnitZ();
  EXPECT_GT(c->rig->gravity_world_m_per_s2.dot(into_print), 9.80);
  EXPECT_EQ(c->parameters.back(), "rig.translation_m[2]");
  const Eigen::VectorXd sigma = c->covariance.diagonal().cwiseSqrt();
  EXPECT_GT(sigma.tail<6>().minCoeff(), 0.0);
  EXPECT_LT(sigma.tail<6>().maxCoeff(), 1e-6) << "corners without noise";
  options.rig_index = 77;
  EXPECT_FALSE(calibrateCameras(s.board, s.photos, options).ok());
}

}  // namespace
}  // namespace tenter
