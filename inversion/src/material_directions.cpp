// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/material_directions.h"

#include <Eigen/LU>
#include <string>

namespace tenter {
namespace {

/// Sine of the angle to a triangle's normal from which on a direction says how its warp runs.
constexpr double kLeastSine = 0.1;

Eigen::Matrix<double, 3, 2> edgesOf(const TriangleMesh& mesh, const Triangle& t) {
  Eigen::Matrix<double, 3, 2> edges;
  edges << mesh.positions.col(t[1]) - mesh.positions.col(t[0]),
      mesh.positions.col(t[2]) - mesh.positions.col(t[0]);
  return edges;
}

}  // namespace

Result<std::vector<MaterialFrame>> framesAlong(const TriangleMesh& target,
                                               const std::vector<Vec3>& warp) {
  std::vector<MaterialFrame> frames;
  for (std::size_t t = 0; t < target.triangles.size(); ++t) {
    const auto edges = edgesOf(target, target.triangles[t]);
    const Vec3 normal = edges.col(0).cross(edges.col(1)).normalized();
    Vec3 v = Vec3::Zero();
    for (const Vec3& direction : warp) {
      const Vec3 unit = direction.normalized();
      v = unit - unit.dot(normal) * normal;
      if (v.norm() >= kLeastSine) break;
    }
    if (!(v.norm() >= kLeastSine)) {
      return badInput("", "triangle " + std::to_string(t),
                      "faces along the direction of the warp, which says nothing about it",
                      "give the target material coordinates, or another direction");
    }
    v.normalize();
    MaterialFrame frame;
    frame << v.cross(normal).transpose() * edges, v.transpose() * edges;
    frames.push_back(frame);
  }
  return frames;
}

Points3 warpOf(const TriangleMesh& target, const std::vector<MaterialFrame>& frames) {
  Points3 out(3, static_cast<Eigen::Index>(frames.size()));
  for (std::size_t t = 0; t < frames.size(); ++t) {
    const Vec3 v = edgesOf(target, target.triangles[t]) * frames[t].inverse().col(1);
    out.col(static_cast<Eigen::Index>(t)) = v.normalized();
  }
  return out;
}

}  // namespace tenter
