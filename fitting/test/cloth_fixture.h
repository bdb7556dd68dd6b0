// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "cloth_replica.h"
#include "kind_fixtures.h"
#include "tenter/mechanics/equilibrium.h"

namespace tenter::kinds {

inline constexpr double kSide_m = 0.1;

/// A clip of the synthetic rig: the box of cloth that it covers, and its pose in each frame.
struct SyntheticClip {
  std::string id;
  Vec2 low, high;
  bool corded = true;
  std::vector<Eigen::Isometry3d> poses;
};

inline Eigen::Isometry3d moved(const Vec3& by) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = by;
  return pose;
}

/// Turned about the vertical through `centre`, whose place moves by `by`.
inline Eigen::Isometry3d turned(double angle, const Vec2& centre, const Vec2& by) {
  const Eigen::Isometry3d turn(Eigen::AngleAxisd(angle, Vec3::UnitZ()));
  const Vec3 c(centre.x(), centre.y(), 0.0), t(by.x(), by.y(), 0.0);
  Eigen::Isometry3d pose = turn;
  pose.translation() = c + t - turn * c;
  return pose;
}

inline std::vector<SyntheticClip> clipsOf(const std::string& protocol, int frames) {
  const double s = kSide_m, d = 0.005;
  std::vector<SyntheticClip> clips;
  const auto add = [&](const char* id, Vec2 low, Vec2 high, bool corded) {
    clips.push_back({id, low, high, corded, {}});
    return &clips.back();
  };
  clips.reserve(4);
  if (protocol.starts_with("bend")) {
    SyntheticClip* table = protocol == "bend-warp" ? add("table", {0, 0}, {s, 0.06}, false)
                                                   : add("table", {0, 0}, {0.06, s}, false);
    for (int f = 0; f < frames; ++f) table->poses.push_back(moved(Vec3::Zero()));
  } else if (protocol == "shear") {
    const double g = 0.01;
    add("top", {g, s - d}, {s - g, s}, true);
    add("right", {s - d, g}, {s, s - g}, true);
    add("bottom", {g, 0}, {s - g, d}, true);
    add("left", {0, g}, {d, s - g}, true);
    for (int f = 0; f < frames; ++f) {
      const double half = 0.03 * (f + 1);
      Mat2 shear;
      shear << std::cos(half), std::sin(half), std::sin(half), std::cos(half);
      for (SyntheticClip& clip : clips) {
        const Vec2 centre = 0.5 * (clip.low + clip.high), middle(0.5 * s, 0.5 * s);
        const bool level = clip.id == "top" || clip.id == "bottom";
        // Two per cent of stretch keep the sheet from buckling.
        const Vec2 place = middle + 1.02 * shear * (centre - middle);
        clip.poses.push_back(turned(level ? half : -half, centre, place - centre));
      }
    }
  } else {
    const bool warp = protocol == "stretch-warp";
    SyntheticClip* near =
        warp ? add("near", {0, 0}, {s, d}, true) : add("near", {0, 0}, {d, s}, true);
    SyntheticClip* far =
        warp ? add("far", {0, s - d}, {s, s}, true) : add("far", {s - d, 0}, {s, s}, true);
    for (int f = 0; f < frames; ++f) {
      near->poses.push_back(moved(Vec3::Zero()));
      far->poses.push_back(moved((warp ? Vec3::UnitY() : Vec3::UnitX()) * 0.0015 * (f + 1)));
    }
  }
  return clips;
}

/// Cords that exert exactly what a clip needs: one for the force and the torque across it, two for
/// the torque along it.
inline void addCords(const ClothSystem& system, const ClothState& state, int clip,
                     const Eigen::Isometry3d& pose, MeasurementFrame& frame) {
  const Wrench cloth = system.clipWrench(state, clip);
  const Vec3 force = -cloth.force_N, torque = -cloth.torque_N_m;
  const auto add = [&](const std::string& name, const Vec3& place, const Vec3& pull) {
    CordReading cord;
    cord.clip = system.setup().clips[clip].id;
    cord.cord = cord.clip + "/" + name;
    cord.attachment_m = pose.inverse() * place;
    cord.direction = pull.normalized();
    cord.tension_N = pull.norm();
    cord.tension_sigma_N = 3e-3;
    frame.cords.push_back(cord);
  };
  const Vec3 along = force.normalized();
  add("pull", force.cross(torque) / force.squaredNorm(), force);
  const Vec3 across = along.unitOrthogonal();
  const Vec3 arm = 0.01 * across.cross(along);
  add("twist-a", arm, torque.dot(along) / 0.02 * across);
  add("twist-b", -arm, -torque.dot(along) / 0.02 * across);
}

/// What cameras and load cells would see, without noise, of a sheet that obeys `truth` on the mesh
/// that a fit with `options` uses.
inline Measurement syntheticCloth(const std::string& protocol, const ParameterSet& truth,
                                  const FitTestOptions& options, int frames = 2, int tracked = 40) {
  Measurement m;
  m.name = protocol;
  m.fabric = m.specimen = "synthetic";
  m.protocol = protocol;
  m.areal_density_kg_per_m2 = 0.15;
  m.sample_size_m = Vec2::Constant(kSide_m);
  m.clip_position_sigma_m = 5e-6;
  m.clip_rotation_sigma_rad = 9e-5;
  m.rest = gridSheet(m.sample_size_m, tracked, tracked, DiagonalPattern::kUniform).rest;
  const std::vector<SyntheticClip> clips = clipsOf(protocol, frames);
  std::vector<ClipOutline> outlines;
  for (const SyntheticClip& clip : clips) {
    outlines.push_back(
        {clip.low, {clip.high.x(), clip.low.y()}, clip.high, {clip.low.x(), clip.high.y()}});
    m.clips.push_back({clip.id, clip.corded ? 0.01 : 0.0, clip.corded ? "bar" : "table"});
  }
  const SheetFrame sheet = sheetFrame(*m.rest).value();
  const GridLines lines = replicaLines(sheet, outlines, options);
  const std::vector<std::vector<int>> held = heldNodes(lines, outlines);
  const Interpolation p = interpolation(lines, m.rest->uv);
  SystemSetup setup;
  setup.areal_density_kg_per_m2 = m.areal_density_kg_per_m2;
  for (std::size_t c = 0; c < clips.size(); ++c) {
    ClipSetup clip;
    clip.id = clips[c].id;
    clip.nodes = held[c];
    clip.mass_kg = m.clips[c].mass_kg;
    setup.clips.push_back(clip);
  }
  ClothSystem system = ClothSystem::create(gridSheet(lines), *truth.model,
                                           makeLaws(*truth.model, truth.components), setup)
                           .value();
  EquilibriumSolver solver(system);
  ClothState state = system.restState();
  for (int f = 0; f < frames; ++f) {
    for (std::size_t c = 0; c < clips.size(); ++c)
      system.setClipPose(state, static_cast<int>(c), clips[c].poses[f]);
    EquilibriumOptions tight;
    tight.force_tolerance_N = 1e-12;
    const EquilibriumSummary solved = solver.solve(state, tight);
    EXPECT_TRUE(solved.converged() && solved.stable)
        << protocol << ": " << describe(solved.termination);
    MeasurementFrame frame;
    frame.time_ns = 1'000'000'000LL * f;
    frame.branch = Branch::kLoading;
    const Points3 nodes = state.positions(system.sheet().nodeCount());
    frame.positions = (p * nodes.transpose()).transpose();
    frame.position_sigma_m.setConstant(frame.positions.cols(), 5e-5);
    frame.valid.assign(frame.positions.cols(), 1);
    for (std::size_t c = 0; c < clips.size(); ++c) {
      ClipReading reading;
      reading.clip = clips[c].id;
      reading.rig_from_clip = clips[c].poses[f];
      reading.outline_uv_m = outlines[c];
      for (int v = 0; v < m.rest->vertexCount(); ++v) {
        const Vec2 uv = m.rest->uv.col(v);
        if ((uv.array() >= clips[c].low.array()).all() &&
            (uv.array() <= clips[c].high.array()).all())
          reading.clamped_vertices.push_back(v);
      }
      frame.clips.push_back(reading);
      if (!clips[c].corded) continue;
      addCords(system, state, static_cast<int>(c), reading.rig_from_clip, frame);
    }
    m.frames.push_back(frame);
  }
  return m;
}

}  // namespace tenter::kinds
