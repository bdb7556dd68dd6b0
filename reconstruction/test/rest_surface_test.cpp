// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/rest_surface.h"

#include <gtest/gtest.h>

#include "eight_bits.h"
#include "semi_global.h"
#include "wrinkled_sheet.h"

namespace tenter::reconstruction_test {
namespace {

constexpr unsigned kTextureSeed = 5;

std::vector<GrayImage> photographs(const std::vector<CameraView>& views, const Scene& scene,
                                   unsigned seed) {
  const SpeckleTexture texture(kTextureSeed);
  std::vector<GrayImage> images;
  for (const CameraView& view : views) images.push_back(photograph(scene, view, texture, seed++));
  return images;
}

struct DepthErrors {
  double rms_m = 0.0;
  double inside = 0.0;  ///< Share of errors within one sigma.
  std::size_t count = 0;
};

/// Height over the true surface at the same place, with its sigma.
DepthErrors depthErrors(const RestSurface& surface) {
  DepthErrors errors;
  for (const RestVertex& vertex : surface.vertices) {
    if (vertex.state != PointState::kValid) continue;
    const Vec3& at = vertex.point.position_m;
    const double error = at.z() - wrinkled(at.head<2>()).z();
    constexpr double kStep_m = 1e-6;
    const double slope_x =
        (wrinkled(at.head<2>() + Vec2(kStep_m, 0.0)) - wrinkled(at.head<2>())).z() / kStep_m;
    const double slope_y =
        (wrinkled(at.head<2>() + Vec2(0.0, kStep_m)) - wrinkled(at.head<2>())).z() / kStep_m;
    const Vec3 across(-slope_x, -slope_y, 1.0);
    const double sigma = std::sqrt(across.dot(vertex.point.covariance_m2 * across));
    errors.rms_m += error * error;
    errors.inside += std::abs(error) <= sigma ? 1.0 : 0.0;
    ++errors.count;
  }
  errors.rms_m = std::sqrt(errors.rms_m / static_cast<double>(errors.count));
  errors.inside /= static_cast<double>(errors.count);
  return errors;
}

struct Seen {
  DepthErrors errors;
  double coarse_rms_m = 0.0;  ///< Of the first pair's semi-global matching alone.
};

/// The wrinkled sheet by the first `count` of four cameras.
Seen wrinklesSeenBy(int count) {
  auto views = fourCameras();
  views.erase(views.begin() + count, views.end());
  const auto images = photographs(views, Scene{wrinkled}, 11);
  SurfaceOptions options;
  options.correlate.threads = 2;
  const auto surface = findSurface(views, images, options);
  Seen seen;
  EXPECT_TRUE(surface.ok());
  if (!surface) return seen;
  seen.errors = depthErrors(*surface);
  const auto coarse =
      semiGlobalPoints(views[0], eightBits(images[0]), views[1], eightBits(images[1]), 2);
  double sum = 0.0;
  for (const SeenPoint& p : *coarse) {
    const double e = p.position_m.z() - wrinkled(p.position_m.head<2>()).z();
    sum += std::min(e * e, 1e-6);
  }
  seen.coarse_rms_m = std::sqrt(sum / static_cast<double>(coarse->size()));
  std::printf(
      "%d views: %zu of %td vertices, depth rms %.4f mm, %.1f %% within sigma, inflation %.2f; "
      "semi-global alone %.4f mm\n",
      count, seen.errors.count, surface->mesh.positions.cols(), 1e3 * seen.errors.rms_m,
      100.0 * seen.errors.inside, surface->inflation, 1e3 * seen.coarse_rms_m);
  return seen;
}

TEST(RestSurface, TwoViewsSeeWrinklesFarBetterThanSemiGlobalMatching) {
  const Seen seen = wrinklesSeenBy(2);
  EXPECT_LE(seen.errors.rms_m, 0.012e-3);
  EXPECT_LE(seen.errors.rms_m, 0.2 * seen.coarse_rms_m);
}

TEST(RestSurface, FourViewsSeeWrinklesToAHundredthOfAMillimetre) {
  EXPECT_LE(wrinklesSeenBy(4).errors.rms_m, 0.010e-3);
}

}  // namespace
}  // namespace tenter::reconstruction_test
