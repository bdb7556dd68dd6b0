// SPDX-License-Identifier: GPL-3.0-or-later
// Cameras that look at a textured surface of numbers, by casting a ray for every pixel.
#pragma once

#include <Eigen/LU>
#include <functional>
#include <numbers>
#include <vector>

#include "speckle.h"
#include "tenter/reconstruction/camera_view.h"

namespace tenter::reconstruction_test {

/// Place in space of a material point (u, v) [m].
using Surface = std::function<Vec3(const Vec2&)>;

struct Scene {
  Surface surface;
  Vec2 size_m = Vec2(0.1, 0.1);  ///< The sheet covers [0, size]; beside it there is grey.
  double texture_m = 0.25e-3;    ///< What a pixel of the texture covers.
  double noise = 2.0;            ///< [grey levels].
};

inline constexpr int kRaysASide = 2;  ///< Of a pixel.

inline double wave(double x, double length) {
  return std::sin(2.0 * std::numbers::pi * x / length);
}

/// Wrinkles of 1 mm and 25 to 40 mm length.
inline Vec3 wrinkled(const Vec2& uv) {
  return {uv.x(), uv.y(), 1e-3 * wave(uv.x() + 0.4 * uv.y(), 0.025) + 0.7e-3 * wave(uv.y(), 0.04)};
}

/// A camera that looks at the middle of a sheet of 0.1 m from a direction, at `pixel_m` a pixel.
inline CameraView cameraAt(const std::string& name, double azimuth_rad, double tilt_rad,
                           double pixel_m, int width = 520, int height = 480) {
  constexpr double kDistance_m = 0.6;
  Lens lens;
  lens.fx_px = kDistance_m / pixel_m;
  lens.fy_px = 1.001 * lens.fx_px;
  lens.cx_px = 0.5 * width + 3.0;
  lens.cy_px = 0.5 * height - 2.0;
  lens.distortion = {-0.12, 0.09, 6e-4, -4e-4, -0.02};
  const Vec3 outwards(std::sin(tilt_rad) * std::cos(azimuth_rad),
                      std::sin(tilt_rad) * std::sin(azimuth_rad), std::cos(tilt_rad));
  const Vec3 z = -outwards;
  const Vec3 x = (Vec3::UnitX() - z.x() * z).normalized();
  Eigen::Isometry3d space_from_camera = Eigen::Isometry3d::Identity();
  space_from_camera.linear() << x, z.cross(x), z;
  space_from_camera.translation() = Vec3(0.05, 0.05, 0.0) + kDistance_m * outwards;
  return {name, *CameraModel::make(width, height, lens), space_from_camera.inverse()};
}

/// Four cameras around the sheet's normal, 20 degrees off it.
inline std::vector<CameraView> fourCameras(double pixel_m = 0.25e-3) {
  std::vector<CameraView> views;
  const double tilt = 20.0 * std::numbers::pi / 180.0;
  for (int k = 0; k < 4; ++k) {
    views.push_back(
        cameraAt("c" + std::to_string(k), (0.25 + 0.5 * k) * std::numbers::pi, tilt, pixel_m));
  }
  return views;
}

/// Material point that a pixel shows, by Newton from `uv`; not finite if the ray misses.
inline Vec2 materialSeen(const CameraView& view, const Surface& surface, const Vec2& pixel,
                         Vec2 uv) {
  const Vec3 centre = view.centre(), direction = *view.direction(pixel);
  double along = (surface(uv) - centre).norm();
  for (int i = 0; i < 20; ++i) {
    const Vec3 off = surface(uv) - centre - along * direction;
    constexpr double kStep_m = 1e-6;
    Mat3 jacobian;
    jacobian.col(0) = (surface(uv + Vec2(kStep_m, 0.0)) - surface(uv)) / kStep_m;
    jacobian.col(1) = (surface(uv + Vec2(0.0, kStep_m)) - surface(uv)) / kStep_m;
    jacobian.col(2) = -direction;
    const Vec3 step = jacobian.partialPivLu().solve(off);
    uv -= step.head<2>();
    along -= step.z();
    if (step.norm() < 1e-9) return uv;
  }
  return Vec2::Constant(std::numeric_limits<double>::quiet_NaN());
}

inline GrayImage photograph(const Scene& scene, const CameraView& view,
                            const SpeckleTexture& texture, unsigned seed) {
  GrayImage image(view.model.widthPx(), view.model.heightPx());
  for (int y = 0; y < image.height; ++y) {
    Vec2 last = 0.5 * scene.size_m;
    for (int x = 0; x < image.width; ++x) {
      // A pixel sees the light of all its area.
      double sum = 0.0;
      for (int ray = 0; ray < kRaysASide * kRaysASide; ++ray) {
        const Vec2 within((ray % kRaysASide + 0.5) / kRaysASide - 0.5,
                          (ray / kRaysASide + 0.5) / kRaysASide - 0.5);
        const Vec2 uv = materialSeen(view, scene.surface, Vec2(x, y) + within, last);
        const bool on = uv.allFinite() && (uv.array() >= 0.0).all() &&
                        (uv.array() <= scene.size_m.array()).all();
        sum += on ? texture.at(uv / scene.texture_m) : 60.0;
        if (uv.allFinite()) last = uv;
      }
      image.at(x, y) = static_cast<float>(sum / (kRaysASide * kRaysASide));
    }
  }
  return photographed(std::move(image), scene.noise, seed);
}

}  // namespace tenter::reconstruction_test
