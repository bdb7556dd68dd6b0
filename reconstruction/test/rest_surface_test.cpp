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

TEST(RestSurface, TwoViewsSeeWrinklesFourTimesBetterThanSemiGlobalMatching) {
  auto views = fourCameras();
  views.erase(views.begin() + 2, views.end());
  Scene scene{wrinkled};
  const auto images = photographs(views, scene, 11);
  SurfaceOptions options;
  options.correlate.threads = 2;
  const auto surface = findSurface(views, images, options);
  ASSERT_TRUE(surface.ok()) << surface.error().message();
  const DepthErrors errors = depthErrors(*surface);
  std::printf(
      "vertices %td valid %zu: depth rms %.4f mm, %.1f %% inside, inflation %.2f, residual %.4f "
      "px\n",
      surface->mesh.positions.cols(), errors.count, 1e3 * errors.rms_m, 100 * errors.inside,
      surface->inflation, surface->residual_px);
  const auto coarse =
      semiGlobalPoints(views[0], eightBits(images[0]), views[1], eightBits(images[1]), 2);
  double sum = 0.0;
  for (const SeenPoint& p : *coarse) {
    const double e = p.position_m.z() - wrinkled(p.position_m.head<2>()).z();
    sum += std::min(e * e, 1e-6);
  }
  const double coarse_rms_m = std::sqrt(sum / double(coarse->size()));
  std::printf("semi-global: %zu points rms %.4f mm\n", coarse->size(), 1e3 * coarse_rms_m);
  EXPECT_LE(errors.rms_m, 0.25 * coarse_rms_m);
}

}  // namespace
}  // namespace tenter::reconstruction_test
