// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/flat_pattern.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

namespace tenter {
namespace {

/// Rings of points (radius, height) about the z axis; the first may be a single point.
TriangleMesh revolved(const std::vector<Vec2>& profile, int around) {
  std::vector<Vec3> points;
  std::vector<Vec2> uv;
  std::vector<int> first;
  for (const Vec2& p : profile) {
    first.push_back(static_cast<int>(points.size()));
    for (int i = 0; i < (p[0] > 0.0 ? around : 1); ++i) {
      const double a = 2.0 * std::numbers::pi * i / around;
      points.emplace_back(p[0] * std::cos(a), p[0] * std::sin(a), p[1]);
    }
  }
  TriangleMesh mesh;
  mesh.positions.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t v = 0; v < points.size(); ++v)
    mesh.positions.col(static_cast<Eigen::Index>(v)) = points[v];
  for (std::size_t j = 0; j + 1 < profile.size(); ++j) {
    for (int i = 0; i < around; ++i) {
      const int next = (i + 1) % around, c = first[j + 1] + i, d = first[j + 1] + next;
      if (profile[j][0] == 0.0) {
        mesh.triangles.push_back({first[j], c, d});
        continue;
      }
      mesh.triangles.push_back({first[j] + i, c, d});
      mesh.triangles.push_back({first[j] + i, d, first[j] + next});
    }
  }
  return mesh;
}

double areaOf(const FlatPattern& p) {
  double sum = 0.0;
  for (const Triangle& t : p.triangles) {
    const Vec2 a = p.places.col(t[1]) - p.places.col(t[0]),
               b = p.places.col(t[2]) - p.places.col(t[0]);
    sum += 0.5 * (a[0] * b[1] - a[1] * b[0]);
  }
  return sum;
}

TEST(FlatPatternTest, ATubeOpensIntoARectangle) {
  const int around = 24;
  const TriangleMesh tube = revolved({{0.1, 0.5}, {0.1, 0.4}, {0.1, 0.3}, {0.1, 0.2}}, around);
  const auto p = unroll(tube, {});
  ASSERT_TRUE(p.ok()) << p.error().message();
  EXPECT_LT(p->distortion, 1e-9);
  EXPECT_EQ(p->cuts, 1);
  EXPECT_EQ(p->vertices.size(), tube.positions.cols() + 4u);
  EXPECT_NEAR(areaOf(*p), around * 0.2 * std::sin(std::numbers::pi / around) * 0.3, 1e-9);
  EXPECT_EQ(p->outline.size(), 2u * around + 2u * 3u);
  EXPECT_EQ(std::count(p->outline_is_cut.begin(), p->outline_is_cut.end(), 1), 6);
}

TEST(FlatPatternTest, AConeWithItsTipIsCutToTheTip) {
  std::vector<Vec2> profile;
  for (int j = 0; j <= 6; ++j) profile.emplace_back(0.05 * j, -0.05 * j);
  const TriangleMesh cone = revolved(profile, 30);
  const auto p = unroll(cone, {});
  ASSERT_TRUE(p.ok()) << p.error().message();
  EXPECT_LT(p->distortion, 1e-6);
  EXPECT_EQ(p->cuts, 1);
  EXPECT_EQ(p->outline.size(), 30u + 2u * 6u);
}

TEST(FlatPatternTest, ADomeIsRefusedWithItsDistortion) {
  std::vector<Vec2> profile;
  for (int j = 0; j <= 8; ++j) {
    const double a = 0.5 * std::numbers::pi * j / 8;
    profile.emplace_back(0.1 * std::sin(a), 0.1 * std::cos(a));
  }
  FlatPatternOptions options;
  options.max_cuts = 2;
  const auto p = unroll(revolved(profile, 24), options);
  ASSERT_FALSE(p.ok());
  EXPECT_NE(p.error().reason.find("%"), std::string::npos) << p.error().reason;
}

TEST(FlatPatternTest, AClosedSurfaceIsRefused) {
  const TriangleMesh ball = revolved({{0.0, 0.1}, {0.1, 0.05}, {0.1, -0.05}}, 12);
  TriangleMesh closed = ball;
  const int pole = ball.vertexCount(), ring = pole - 12;
  closed.positions.conservativeResize(3, pole + 1);
  closed.positions.col(pole) = Vec3(0.0, 0.0, -0.1);
  for (int i = 0; i < 12; ++i) closed.triangles.push_back({pole, ring + (i + 1) % 12, ring + i});
  EXPECT_FALSE(unroll(closed, {}).ok());
}

TEST(FlatPatternTest, WhatWouldOverlapItselfIsRefused) {
  // A helicoid of three turns about a wide tube: flat lengths, but more than once around.
  TriangleMesh ribbon;
  const int n = 90;
  ribbon.positions.resize(3, 2 * (n + 1));
  for (int i = 0; i <= n; ++i) {
    const double a = 3.0 * 2.0 * std::numbers::pi * i / n;
    ribbon.positions.col(2 * i) = Vec3(0.1 * std::cos(a), 0.1 * std::sin(a), 1e-4 * i);
    ribbon.positions.col(2 * i + 1) = Vec3(0.2 * std::cos(a), 0.2 * std::sin(a), 1e-4 * i);
    if (i == n) continue;
    ribbon.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 3});
    ribbon.triangles.push_back({2 * i, 2 * i + 3, 2 * i + 2});
  }
  const auto p = unroll(ribbon, {});
  ASSERT_FALSE(p.ok());
  EXPECT_NE(p.error().reason.find("overlap"), std::string::npos) << p.error().reason;
}

TEST(FlatPatternTest, TheDrawingIsInMillimetres) {
  const auto p = unroll(revolved({{0.1, 0.5}, {0.1, 0.2}}, 24), {});
  ASSERT_TRUE(p.ok());
  const std::string svg = patternSvg(*p, "a < b");
  EXPECT_NE(svg.find("a &lt; b"), std::string::npos);
  double width = 0.0, height = 0.0;
  ASSERT_EQ(std::sscanf(svg.c_str() + svg.find("width"), "width=\"%lfmm\" height=\"%lfmm\"", &width,
                        &height),
            2);
  const Vec2 size = p->places.rowwise().maxCoeff() - p->places.rowwise().minCoeff();
  EXPECT_NEAR(width, 1e3 * size[0] + 20.0, 1e-3);
}

}  // namespace
}  // namespace tenter
