// SPDX-License-Identifier: GPL-3.0-or-later
// Predicted uncertainty against the scatter of thirty fits to newly drawn noise.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "bundle.h"
#include "virtual_rig.h"

namespace tenter {
namespace {

constexpr int kRuns = 30, kSets = 10, kRigSet = 2;
constexpr double kNoise_px = 0.1;
const Vec2 kWarp_m(2e-4, -1e-4);

Bundle truth(const Board& board, const std::vector<virtual_rig::Camera>& cameras,
             const std::vector<Eigen::Isometry3d>& poses) {
  Bundle bundle;
  bundle.board_m = board.cornerPositions();
  bundle.warp_m = kWarp_m;
  for (const auto& camera : cameras) {
    bundle.lenses.push_back(camera.lens);
    bundle.cameras.push_back(poseVector(camera.camera_from_world));
  }
  for (const auto& pose : poses) bundle.boards.push_back(poseVector(pose));
  return bundle;
}

/// A small turn on the left and a displacement that take one pose to the other.
std::pair<Vec3, Vec3> changeOf(const PoseVector& fit, const PoseVector& truth) {
  const auto is = poseOf(fit), was = poseOf(truth);
  const Eigen::AngleAxisd turn(Mat3(is.linear() * was.linear().transpose()));
  return {turn.angle() * turn.axis(), is.translation() - was.translation()};
}

/// Fit minus truth in the parameters of BundleCovariance.
Eigen::VectorXd errorOf(const Bundle& fit, const Bundle& true_bundle) {
  std::vector<double> out;
  const auto append = [&out](const auto& values) {
    out.insert(out.end(), values.data(), values.data() + values.size());
  };
  for (std::size_t i = 0; i < fit.lenses.size(); ++i) {
    append(LensVector(fit.lenses[i] - true_bundle.lenses[i]));
    if (i == 0) continue;
    const auto [turn, shift] = changeOf(fit.cameras[i], true_bundle.cameras[i]);
    append(turn);
    append(shift);
  }
  append(Vec2(fit.warp_m - true_bundle.warp_m));
  const auto [turn, shift] = changeOf(fit.boards[kRigSet], true_bundle.boards[kRigSet]);
  append(turn);
  append(shift);
  return Eigen::Map<Eigen::VectorXd>(out.data(), static_cast<Eigen::Index>(out.size()));
}

TEST(BundleCovarianceTest, AgreesWithThirtyRedrawnFits) {
  std::mt19937_64 random(11);
  const Board board = virtual_rig::chessboard();
  const auto cameras = virtual_rig::cameras(2);
  const auto poses = virtual_rig::boardPoses(board, kSets, random);
  const Bundle true_bundle = truth(board, cameras, poses);
  BundleOptions options;
  options.fit_warp = true;
  options.rig_set = kRigSet;
  double mahalanobis = 0.0, noise = 0.0;
  Eigen::VectorXd squares, predicted;
  for (int run = 0; run < kRuns; ++run) {
    Bundle bundle = true_bundle;
    const auto photos = virtual_rig::photograph(board, cameras, poses, kNoise_px, random, kWarp_m);
    for (int camera = 0; camera < 2; ++camera) {
      for (const BoardPhoto& photo : photos[camera].photos) {
        bundle.images.push_back({camera, photo.index, photo.corners});
      }
    }
    ASSERT_TRUE(solveBundle(bundle, options));
    const BundleCovariance covariance = bundleCovariance(bundle, options);
    ASSERT_TRUE(covariance.observable);
    const Eigen::VectorXd error = errorOf(bundle, true_bundle);
    ASSERT_EQ(error.size(), covariance.matrix.rows());
    if (run == 0) squares = predicted = Eigen::VectorXd::Zero(error.size());
    mahalanobis += error.dot(covariance.matrix.ldlt().solve(error));
    squares += error.cwiseAbs2();
    predicted += covariance.matrix.diagonal();
    noise += covariance.noise_px / kRuns;
  }
  const double size = static_cast<double>(squares.size());
  // Chi-squared with runs x size degrees of freedom: its mean over them has deviation 0.051.
  EXPECT_NEAR(mahalanobis / (kRuns * size), 1.0, 0.2);
  EXPECT_NEAR(noise, kNoise_px, 0.005);
  for (Eigen::Index i = 0; i < squares.size(); ++i) {
    // Each ratio of deviations scatters by 1 / sqrt(60) = 0.13; three and a half of that.
    EXPECT_NEAR(std::sqrt(squares[i] / predicted[i]), 1.0, 0.45) << "parameter " << i;
  }
}

TEST(BundleCovarianceTest, SaysWhenADirectionIsNotSeen) {
  // A camera that shares no set with the first can be anywhere.
  std::mt19937_64 random(12);
  const Board board = virtual_rig::chessboard();
  const auto cameras = virtual_rig::cameras(2);
  const auto poses = virtual_rig::boardPoses(board, 8, random);
  Bundle bundle = truth(board, cameras, poses);
  const auto photos = virtual_rig::photograph(board, cameras, poses, kNoise_px, random);
  for (int set = 0; set < 8; ++set) {
    bundle.images.push_back({set % 2, set, photos[set % 2].photos[set].corners});
  }
  EXPECT_FALSE(bundleCovariance(bundle, {}).observable);
}

}  // namespace
}  // namespace tenter
