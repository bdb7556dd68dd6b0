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

TEST(ClothTracker, FollowsVerticesInSpace) {
  const auto views = fourCameras();
  const SpeckleTexture texture(kTextureSeed);
  unsigned seed = 31;
  const auto photographs = [&](double amount) {
    std::vector<GrayImage> images;
    for (const CameraView& view : views) {
      images.push_back(photograph({deformed(amount)}, view, texture, seed++));
    }
    return images;
  };
  SurfaceOptions options;
  options.correlate.threads = 2;
  options.vertices_per_side = 40;
  const auto images = photographs(0.0);
  const auto surface = findSurface(views, images, options);
  ASSERT_TRUE(surface.ok()) << surface.error().message();
  auto tracker = ClothTracker::create(views, images, *surface, options);
  ASSERT_TRUE(tracker.ok());
  for (const double amount : {0.3, 0.6, 1.0}) {
    const auto frame = tracker->track(photographs(amount));
    ASSERT_TRUE(frame.ok());
    Vec3 squares = Vec3::Zero(), inside = Vec3::Zero();
    double count = 0.0, worst = 0.0;
    for (int i = 0; i < surface->mesh.vertexCount(); ++i) {
      if (frame->states[i] != PointState::kValid) continue;
      // At rest the sheet is flat, so the place of a vertex is its material point.
      const Vec2 uv = surface->mesh.positions.col(i).head<2>();
      const Vec3 error = frame->positions_m.col(i) - deformed(amount)(uv);
      squares += error.cwiseAbs2();
      for (int k = 0; k < 3; ++k)
        inside[k] += std::abs(error[k]) <= std::sqrt(frame->covariances_m2[i](k, k)) ? 1 : 0;
      worst = std::max(worst, error.norm());
      count += 1.0;
    }
    std::printf("%g: %.0f of %d valid, rms mm %.4f %.4f %.4f worst %.4f inside %.2f %.2f %.2f\n",
                amount, count, surface->mesh.vertexCount(), 1e3 * std::sqrt(squares.x() / count),
                1e3 * std::sqrt(squares.y() / count), 1e3 * std::sqrt(squares.z() / count),
                1e3 * worst, inside.x() / count, inside.y() / count, inside.z() / count);
    EXPECT_GT(count, 0.99 * surface->mesh.vertexCount());
    EXPECT_LT(std::sqrt(squares.sum() / count), 0.03e-3);
    // Neighbouring subsets share texture, so six hundred vertices count for about a hundred: 0.05.
    // Along the cameras sigma is a little wide, since views share the noise of the image at rest.
    const Vec3 share = inside / count;
    EXPECT_NEAR(share.x(), 0.683, 0.1);
    EXPECT_NEAR(share.y(), 0.683, 0.1);
    EXPECT_NEAR(share.z(), 0.683, 0.15);
  }
}

}  // namespace
}  // namespace tenter::reconstruction_test
