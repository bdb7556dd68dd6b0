// SPDX-License-Identifier: GPL-3.0-or-later
// Residuals of views that are off by constants, with noise on top.
#include "view_offsets.h"

#include <gtest/gtest.h>

#include <random>

namespace tenter {
namespace {

constexpr double kNoise_px = 0.003;

CameraView viewFrom(const Vec3& centre) {
  CameraView view{"", *CameraModel::make(960, 720, {1500.0, 1500.0, 480.0, 360.0, {}}),
                  Eigen::Isometry3d::Identity()};
  const Vec3 forward = -centre.normalized();
  const Vec3 right = Vec3::UnitY().cross(forward).normalized();
  view.camera_from_space.linear() << right.transpose(), forward.cross(right).transpose(),
      forward.transpose();
  view.camera_from_space.translation() = -view.camera_from_space.linear() * centre;
  return view;
}

/// A flat sheet as four views see it, each off by an offset of its own.
std::vector<RestVertex> sheet(const std::vector<CameraView>& views, const std::vector<Vec2>& off,
                              std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, kNoise_px);
  std::vector<RestVertex> vertices;
  for (int j = 0; j < 30; ++j)
    for (int i = 0; i < 30; ++i) {
      const Vec3 place(0.003 * (i - 15), 0.003 * (j - 15), 0.0);
      RestVertex vertex;
      std::vector<Sighting> seen;
      for (int v = 0; v < static_cast<int>(views.size()); ++v)
        seen.push_back({v, *views[v].project(place) + off[v] + Vec2(noise(random), noise(random)),
                        kNoise_px * kNoise_px * Mat2::Identity()});
      vertex.point = *triangulate(views, seen);
      vertex.state = PointState::kValid;
      for (const Sighting& s : seen) vertex.sightings.push_back({s, s.pixel});
      vertices.push_back(vertex);
    }
  return vertices;
}

TEST(ViewOffsetsTest, TellOffsetsFromNoise) {
  const std::vector<CameraView> views{viewFrom({0.2, 0.0, 0.5}), viewFrom({-0.2, 0.0, 0.5}),
                                      viewFrom({0.0, 0.2, 0.5}), viewFrom({0.0, -0.2, 0.5})};
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const double offset_px : {0.0, 0.02}) {
    double squares = 0.0, chi2 = 0.0;
    constexpr int kDraws = 30;
    for (int draw = 0; draw < kDraws; ++draw) {
      std::vector<Vec2> off;
      for (std::size_t v = 0; v < views.size(); ++v)
        off.push_back(offset_px * Vec2(normal(random), normal(random)));
      const std::vector<RestVertex> vertices = sheet(views, off, random);
      const ViewOffsets found(views, vertices);
      squares += found.offsetPx() * found.offsetPx() / kDraws;
      for (const RestVertex& vertex : vertices)
        chi2 += found.chi2(vertex) / static_cast<double>(vertices.size() * kDraws);
    }
    // Thirty draws of five numbers that can be seen: the root scatters by 6 %.
    EXPECT_NEAR(std::sqrt(squares), offset_px, 0.2 * offset_px + 0.1 * kNoise_px);
    EXPECT_NEAR(chi2, 5.0, 0.25) << "two numbers a view less three of the place";
  }
}

}  // namespace
}  // namespace tenter
