// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/material_directions.h"

#include <Eigen/LU>
#include <functional>
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

/// Of the first direction that runs along the triangle's plane, as far as that goes.
Result<MaterialFrame> frameAlong(const TriangleMesh& target, std::size_t triangle,
                                 const std::vector<Vec3>& warp) {
  const auto edges = edgesOf(target, target.triangles[triangle]);
  const Vec3 normal = edges.col(0).cross(edges.col(1)).normalized();
  Vec3 v = Vec3::Zero();
  for (const Vec3& direction : warp) {
    const Vec3 unit = direction.normalized();
    v = unit - unit.dot(normal) * normal;
    if (v.norm() >= kLeastSine) break;
  }
  if (!(v.norm() >= kLeastSine)) {
    return badInput("", "triangle " + std::to_string(triangle),
                    "faces along the direction of the warp, which says nothing about it",
                    "give the target material coordinates, or another direction");
  }
  v.normalize();
  MaterialFrame frame;
  frame << v.cross(normal).transpose() * edges, v.transpose() * edges;
  return frame;
}

Result<std::vector<MaterialFrame>> framesBy(
    const TriangleMesh& target, const std::function<std::vector<Vec3>(std::size_t)>& warpAt) {
  std::vector<MaterialFrame> frames;
  for (std::size_t t = 0; t < target.triangles.size(); ++t) {
    auto frame = frameAlong(target, t, warpAt(t));
    if (!frame) return frame.error();
    frames.push_back(*std::move(frame));
  }
  return frames;
}

}  // namespace

Result<std::vector<MaterialFrame>> framesAlong(const TriangleMesh& target,
                                               const std::vector<Vec3>& warp) {
  return framesBy(target, [&](std::size_t) { return warp; });
}

Result<std::vector<MaterialFrame>> framesFromWarp(const TriangleMesh& target, const Points3& warp) {
  require(warp.cols() == static_cast<Eigen::Index>(target.triangles.size()),
          "framesFromWarp: one direction a triangle");
  return framesBy(target, [&](std::size_t t) {
    return std::vector<Vec3>{warp.col(static_cast<Eigen::Index>(t))};
  });
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
