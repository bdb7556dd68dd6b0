// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/rest_surface.h"

#include <gtest/gtest.h>

#include "eight_bits.h"
#include "semi_global.h"
#include "wrinkled_sheet.h"

namespace tenter::reconstruction_test {
namespace {

constexpr unsigned kTextureSeed = 5;

constexpr unsigned kSeeds = 3;  ///< Of noise.
constexpr double kNoise = 2.0;  ///< [grey levels]

/// The wrinkled sheet without noise, which is added to it later.
const std::vector<GrayImage>& stillPhotographs() {
  static const std::vector<GrayImage> kImages = [] {
    const SpeckleTexture texture(kTextureSeed);
    Scene scene{wrinkled};
    scene.noise = 0.0;
    std::vector<GrayImage> images;
    for (const CameraView& view : fourCameras())
      images.push_back(photograph(scene, view, texture, 0));
    return images;
  }();
  return kImages;
}

std::vector<GrayImage> photographs(std::size_t count, unsigned seed) {
  std::vector<GrayImage> images;
  for (std::size_t k = 0; k < count; ++k)
    images.push_back(
        photographed(stillPhotographs()[k], kNoise, 100 * seed + static_cast<unsigned>(k)));
  return images;
}

struct DepthErrors {
  double squares_m2 = 0.0;
  double inside = 0.0, count = 0.0;  ///< Errors within one sigma; all.

  double rms_m() const { return std::sqrt(squares_m2 / count); }
  double share() const { return inside / count; }
};

/// Height over the true surface at the same place, with its sigma.
void addDepthErrors(const RestSurface& surface, DepthErrors& errors) {
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
    errors.squares_m2 += error * error;
    errors.inside += std::abs(error) <= sigma ? 1.0 : 0.0;
    errors.count += 1.0;
  }
}

struct Seen {
  DepthErrors errors;
  double coarse_rms_m = 0.0;  ///< Of the first pair's semi-global matching alone.
};

/// The wrinkled sheet by the first `count` of four cameras, with noise of several seeds.
Seen wrinklesSeenBy(std::size_t count) {
  auto views = fourCameras();
  views.resize(count, views.front());
  SurfaceOptions options;
  options.correlate.threads = 2;
  Seen seen;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const auto surface = findSurface(views, photographs(count, seed), options);
    EXPECT_TRUE(surface.ok());
    if (surface) addDepthErrors(*surface, seen.errors);
  }
  const auto images = photographs(2, 1);
  const auto coarse =
      semiGlobalPoints(views[0], eightBits(images[0]), views[1], eightBits(images[1]), 2);
  double sum = 0.0;
  for (const SeenPoint& p : *coarse) {
    const double e = p.position_m.z() - wrinkled(p.position_m.head<2>()).z();
    sum += std::min(e * e, 1e-6);
  }
  seen.coarse_rms_m = std::sqrt(sum / static_cast<double>(coarse->size()));
  std::printf(
      "%zu views: %.0f vertices, depth rms %.4f mm, %.1f %% within sigma; semi-global alone "
      "%.4f mm\n",
      count, seen.errors.count, 1e3 * seen.errors.rms_m(), 100.0 * seen.errors.share(),
      1e3 * seen.coarse_rms_m);
  return seen;
}

constexpr double kLeastShare = 0.65, kLargestShare = 0.71;

TEST(RestSurface, TwoViewsSeeWrinklesFarBetterThanSemiGlobalMatching) {
  const Seen seen = wrinklesSeenBy(2);
  EXPECT_LE(seen.errors.rms_m(), 0.012e-3);
  EXPECT_LE(seen.errors.rms_m(), 0.2 * seen.coarse_rms_m);
  EXPECT_GE(seen.errors.share(), kLeastShare);
  EXPECT_LE(seen.errors.share(), kLargestShare);
}

TEST(RestSurface, FourViewsSeeWrinklesToAHundredthOfAMillimetre) {
  const Seen seen = wrinklesSeenBy(4);
  EXPECT_LE(seen.errors.rms_m(), 0.010e-3);
  EXPECT_GE(seen.errors.share(), kLeastShare);
  EXPECT_LE(seen.errors.share(), kLargestShare);
}

}  // namespace
}  // namespace tenter::reconstruction_test
