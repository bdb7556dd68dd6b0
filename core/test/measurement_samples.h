// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <string>

#include "tenter/core/measurement.h"

namespace tenter::samples {

inline constexpr double kSide_m = 0.1;

/// A flat square of nodes x nodes vertices in the plane z = 0, uv = xy, row by row along u.
inline TriangleMesh squareSheet(int nodes, double side_m = kSide_m) {
  TriangleMesh mesh;
  mesh.positions.setZero(3, nodes * nodes);
  mesh.uv.resize(2, nodes * nodes);
  for (int row = 0; row < nodes; ++row) {
    for (int column = 0; column < nodes; ++column) {
      const Vec2 place = side_m / (nodes - 1) * Vec2(column, row);
      mesh.uv.col(row * nodes + column) = place;
      mesh.positions.col(row * nodes + column).head<2>() = place;
    }
  }
  for (int row = 0; row + 1 < nodes; ++row) {
    for (int column = 0; column + 1 < nodes; ++column) {
      const int a = row * nodes + column;
      mesh.triangles.push_back({a, a + 1, a + nodes + 1});
      mesh.triangles.push_back({a, a + nodes + 1, a + nodes});
    }
  }
  return mesh;
}

inline ClipReading clipAt(const std::string& id, const std::vector<int>& vertices, double u_m) {
  constexpr double kDepth_m = 0.005;
  ClipReading clip;
  clip.clip = id;
  clip.rig_from_clip.translation() = Vec3(u_m, 0.5 * kSide_m, 0.0);
  clip.rig_from_clip.linear() =
      Eigen::AngleAxisd(0.3, Vec3(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
  clip.clamped_vertices = vertices;
  const double low = u_m - kDepth_m, high = u_m + kDepth_m;
  clip.outline_uv_m = {{low, 0.0}, {high, 0.0}, {high, kSide_m}, {low, kSide_m}};
  return clip;
}

/// A stretch along the weft by two bar clips, each with one cord.
inline Measurement stretchTest(int nodes = 4, int frames = 3) {
  Measurement m;
  m.fabric = "test cloth";
  m.specimen = "A";
  m.protocol = "stretch-weft";
  m.areal_density_kg_per_m2 = 0.15;
  m.thickness_m = 4e-4;
  m.sample_size_m = Vec2(kSide_m, kSide_m);
  m.clips = {{"left", 0.05, "bar"}, {"right", 0.05, "bar"}};
  m.clip_position_sigma_m = 5e-6;
  m.clip_rotation_sigma_rad = 1e-4;
  m.rest = squareSheet(nodes);
  std::vector<int> left, right;
  for (int row = 0; row < nodes; ++row) {
    left.push_back(row * nodes);
    right.push_back(row * nodes + nodes - 1);
  }
  for (int i = 0; i < frames; ++i) {
    const double stretch = 1.0 + 0.01 * i;
    MeasurementFrame frame;
    frame.time_ns = 1'000'000'000LL * i;
    frame.branch = i == 0 ? Branch::kUnknown : Branch::kLoading;
    frame.clips = {clipAt("left", left, 0.0), clipAt("right", right, kSide_m)};
    frame.cords = {
        {"west", "left", Vec3(-0.01, 0, 0), -Vec3::UnitX(), 0.1 * i, 0.003},
        {"east", "right", Vec3(0.01, 0, 0), Vec3(0.6, 0.0, 0.8), 0.1 * i + 1.0 / 3.0, 0.003}};
    frame.positions = m.rest->positions;
    frame.positions.row(0) *= stretch;
    frame.position_sigma_m.setConstant(nodes * nodes, 5e-5);
    if (!m.frames.empty()) {  // not every frame knows its axes apart
      frame.position_sigma_axes_m.resize(3, nodes * nodes);
      frame.position_sigma_axes_m.colwise() = Vec3(3e-5, 4e-5, 7e-5);
    }
    frame.valid.assign(static_cast<std::size_t>(nodes * nodes), 1);
    frame.valid[1] = 0;
    m.frames.push_back(frame);
  }
  return m;
}

inline Measurement tensileTest() {
  Measurement m;
  m.fabric = "nylon";
  m.protocol = "tensile";
  m.areal_density_kg_per_m2 = 0.0616;
  m.tensile = TensileSetup{0.097, 0.00225, 12, 0.0, 1e-5, "first-row"};
  for (int i = 0; i < 5; ++i) {
    MeasurementFrame frame;
    frame.branch = Branch::kLoading;
    frame.displacement_m = 1e-3 * i;
    frame.force_N = 20.0 * i;
    frame.force_sigma_N = 0.1;
    m.frames.push_back(frame);
  }
  return m;
}

inline Measurement cantileverTest() {
  Measurement m;
  m.fabric = "nylon";
  m.protocol = "cantilever";
  m.areal_density_kg_per_m2 = 0.0616;
  m.cantilever = CantileverSetup{0.075, 0.025, 0.0};
  m.frames.resize(1);
  m.frames[0].reach_m = 0.0381;
  m.frames[0].drop_m = 0.0635;
  m.frames[0].tip_sigma_m = 5e-4;
  return m;
}

}  // namespace tenter::samples
