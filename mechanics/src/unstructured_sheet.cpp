// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>

#include "flat_sheet.h"

namespace tenter {
namespace {

/// Displacement of a point, in edge lengths: keeps angles above 20 degrees.
constexpr double kJitter = 0.13;
/// Distance of the enclosing triangle, in sizes of the point set: far enough not to cut the convex
/// hull, near enough for doubles.
constexpr double kEnclosure = 1e4;

/// Uniform in [-1, 1), the same on every platform.
class Jitter {
 public:
  explicit Jitter(std::uint64_t seed) : engine_(seed) {}
  double operator()() { return std::ldexp(static_cast<double>(engine_() >> 11U), -52) - 1.0; }

 private:
  std::mt19937_64 engine_;
};

std::vector<Vec2> jitteredPoints(const Vec2& size, double edge, std::uint64_t seed) {
  Jitter jitter(seed);
  const int nu = std::max(1, static_cast<int>(std::lround(size[0] / edge)));
  const int rows = std::max(1, static_cast<int>(std::lround(size[1] / (edge * std::sqrt(0.75)))));
  const double du = size[0] / nu, dv = size[1] / rows;
  std::vector<Vec2> points;
  for (int j = 0; j <= rows; ++j) {
    const bool border_row = j == 0 || j == rows;
    const bool staggered = j % 2 == 1 && !border_row;
    const int count = staggered ? nu + 2 : nu + 1;
    for (int i = 0; i < count; ++i) {
      const bool border_column = i == 0 || i == count - 1;
      double u = staggered ? (i - 0.5) * du : i * du;
      double v = j * dv;
      if (staggered && border_column) u = i == 0 ? 0.0 : size[0];
      if (!border_column) u += kJitter * edge * jitter();
      if (!border_row) v += (border_column ? 0.5 : 1.0) * kJitter * edge * jitter();
      if (border_column && !staggered) u = i == 0 ? 0.0 : size[0];
      if (border_row) v = j == 0 ? 0.0 : size[1];
      points.emplace_back(u, v);
    }
  }
  return points;
}

double orientation(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Whether d lies inside the circle through a, b, c (counter-clockwise).
bool inCircle(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  const Vec2 p = a - d, q = b - d, r = c - d;
  return p.squaredNorm() * (q[0] * r[1] - q[1] * r[0]) -
             q.squaredNorm() * (p[0] * r[1] - p[1] * r[0]) +
             r.squaredNorm() * (p[0] * q[1] - p[1] * q[0]) >
         0.0;
}

/// Replaces the triangles whose circle holds the point by a fan around it (Bowyer and Watson).
void insertPoint(const std::vector<Vec2>& points, int id, std::vector<Triangle>* triangles) {
  std::map<std::pair<int, int>, int> border;
  std::vector<Triangle> kept;
  for (const Triangle& t : *triangles) {
    if (!inCircle(points[t[0]], points[t[1]], points[t[2]], points[id])) {
      kept.push_back(t);
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      const std::pair<int, int> edge{t[k], t[(k + 1) % 3]};
      const auto twin = border.find({edge.second, edge.first});
      if (twin != border.end()) {
        border.erase(twin);
      } else {
        border.emplace(edge, 0);
      }
    }
  }
  for (const auto& [edge, unused] : border) kept.push_back({edge.first, edge.second, id});
  *triangles = std::move(kept);
}

std::vector<Triangle> delaunay(std::vector<Vec2> points, const Vec2& size) {
  const int n = static_cast<int>(points.size());
  const double far = kEnclosure * size.maxCoeff();
  points.emplace_back(-far, -far);
  points.emplace_back(far, -far);
  points.emplace_back(0.0, far);
  std::vector<Triangle> triangles{{n, n + 1, n + 2}};
  for (int id = 0; id < n; ++id) insertPoint(points, id, &triangles);
  const double sliver = 1e-9 * size.squaredNorm() / n;
  std::erase_if(triangles, [&](const Triangle& t) {
    return std::max({t[0], t[1], t[2]}) >= n ||
           orientation(points[t[0]], points[t[1]], points[t[2]]) < sliver;
  });
  return triangles;
}

}  // namespace

SheetMesh unstructuredSheet(const Vec2& size_m, double edge_m, std::uint64_t seed) {
  require(size_m.minCoeff() > 0.0 && edge_m > 0.0, "unstructuredSheet: a positive size and edge");
  const std::vector<Vec2> points = jitteredPoints(size_m, edge_m, seed);
  Points2 uv(2, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) uv.col(static_cast<Eigen::Index>(i)) = points[i];
  return flatSheet(
      uv, delaunay(points, size_m),
      "unstructured " + std::to_string(points.size()) + " vertices, seed " + std::to_string(seed));
}

}  // namespace tenter
