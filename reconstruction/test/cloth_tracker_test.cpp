// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/cloth_tracker.h"

#include <gtest/gtest.h>

#include "wrinkled_sheet.h"

namespace tenter::reconstruction_test {
namespace {

constexpr unsigned kTextureSeed = 5;

/// A sheet that is stretched along u, sheared and wrinkled as `amount` goes from 0 to 1.
Surface deformed(double amount) {
  return [amount](const Vec2& uv) -> Vec3 {
    const Vec3 flat(uv.x() * (1.0 + 0.04 * amount) + 0.03 * amount * uv.y(),
                    uv.y() * (1.0 - 0.01 * amount), 0.0);
    return flat + amount * Vec3(0.0, 0.0, 1.5e-3 * wave(uv.x() + 0.5 * uv.y(), 0.05));
  };
}

constexpr unsigned kSeeds = 4;  ///< Of noise.
constexpr double kNoise = 2.0;  ///< [grey levels]

/// What four cameras see without noise.
std::vector<GrayImage> still(double amount) {
  const SpeckleTexture texture(kTextureSeed);
  Scene scene{deformed(amount)};
  scene.noise = 0.0;
  std::vector<GrayImage> images;
  for (const CameraView& view : fourCameras())
    images.push_back(photograph(scene, view, texture, 0));
  return images;
}

std::vector<GrayImage> noisy(std::vector<GrayImage> images, unsigned seed) {
  for (GrayImage& image : images) image = photographed(std::move(image), kNoise, seed++);
  return images;
}

/// Errors against the truth along x, y and z.
struct Errors {
  Vec3 squares_m2 = Vec3::Zero(), inside = Vec3::Zero();
  double count = 0.0;

  void add(const ClothFrame& frame, const RestSurface& surface, double amount) {
    for (int i = 0; i < surface.mesh.vertexCount(); ++i) {
      if (frame.states[i] != PointState::kValid) continue;
      // At rest the sheet is flat, so the place of a vertex is its material point.
      const Vec2 uv = surface.mesh.positions.col(i).head<2>();
      const Vec3 error = frame.positions_m.col(i) - deformed(amount)(uv);
      squares_m2 += error.cwiseAbs2();
      const Vec3 sigma = frame.covariances_m2[i].diagonal().cwiseSqrt();
      inside += (error.cwiseAbs().array() <= sigma.array()).cast<double>().matrix();
      count += 1.0;
    }
  }
};

TEST(ClothTracker, FollowsVerticesInSpaceAndKnowsHowWell) {
  const auto views = fourCameras();
  SurfaceOptions options;
  options.correlate.threads = 2;
  options.vertices_per_side = 40;
  const std::vector<GrayImage> rest = still(0.0), half = still(0.5), whole = still(1.0);
  Errors all;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const auto images = noisy(rest, 1000 * seed);
    const auto surface = findSurface(views, images, options);
    ASSERT_TRUE(surface.ok()) << surface.error().message();
    auto tracker = ClothTracker::create(views, images, *surface, options);
    ASSERT_TRUE(tracker.ok());
    for (const double amount : {0.5, 1.0}) {
      const auto frame = tracker->track(
          noisy(amount < 1.0 ? half : whole, 1000 * seed + (amount < 1.0 ? 10 : 20)));
      ASSERT_TRUE(frame.ok());
      EXPECT_GT(frame->validCount(), 0.99 * surface->mesh.vertexCount());
      Errors one;
      one.add(*frame, *surface, amount);
      all.add(*frame, *surface, amount);
      EXPECT_LT(std::sqrt(one.squares_m2.sum() / one.count), 0.03e-3);
    }
  }
  const Vec3 rms = 1e3 * (all.squares_m2 / all.count).cwiseSqrt(), share = all.inside / all.count;
  std::printf("%.0f vertices, rms mm %.4f %.4f %.4f, inside %.3f %.3f %.3f\n", all.count, rms.x(),
              rms.y(), rms.z(), share.x(), share.y(), share.z());
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GE(share[axis], 0.65) << axis;
    EXPECT_LE(share[axis], 0.71) << axis;
  }
}

}  // namespace
}  // namespace tenter::reconstruction_test
