// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "ray_scene.h"
#include "tenter/twin/scene_renderer.h"

namespace tenter {

/// Directions that a camera's pixels look in: the lens' inverse, tabulated every few pixels and
/// linear in between, which errs by less than 1e-4 px for lenses of a few percent distortion.
class PixelDirections {
 public:
  explicit PixelDirections(const CameraModel& model);
  /// (X / Z, Y / Z) in the camera's frame; not finite where the lens has no inverse.
  Eigen::Vector2d at(double x, double y) const;

 private:
  static constexpr int kSpacing_px = 4;
  int columns_;
  std::vector<Eigen::Vector2d> table_;
};

/// One picture of a scene, by all cores. Each pixel's rays stand on a regular grid in the pixel and
/// on a ring in the lens' pupil, turned at random from pixel to pixel. Noise depends on the
/// options' seed, the camera's name and `number`.
ByteImage expose(const RayScene& scene, const VirtualCamera& camera,
                 const PixelDirections& directions, const RenderOptions& options,
                 std::uint64_t number);

}  // namespace tenter
