// SPDX-License-Identifier: GPL-3.0-or-later
// Photographs of printed pages: pixel by pixel through the lens onto the sheet, with noise.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "tenter/calib/print_page.h"
#include "virtual_rig.h"

namespace tenter::virtual_rig {

/// A page as it lies before the cameras: its raster, and where the board's corner 0 is on it.
struct PrintedSheet {
  ByteImage raster;
  double pixels_per_m = 0.0;
  Vec2 corner_m = Vec2::Zero();  ///< From the page's upper left corner.
};

inline PrintedSheet print(const Board& board, double pixels_per_mm) {
  const PrintPage page = *boardPage(board, *paperByName("fit"));
  // "fit" leaves 18 mm on the left and 8 mm above; the first inner corner is a square further in.
  const double square_mm = 1e3 * board.square_m;
  return {*rasterOf(page, pixels_per_mm), 1e3 * pixels_per_mm,
          1e-3 * Vec2(18.0 + square_mm, 8.0 + square_mm)};
}

inline double levelAt(const PrintedSheet& sheet, const Vec2& board_m) {
  constexpr double kBackground = 110.0;
  const Vec2 at = sheet.pixels_per_m * (board_m + sheet.corner_m) - Vec2(0.5, 0.5);
  const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  if (x < 0 || y < 0 || x + 1 >= sheet.raster.width || y + 1 >= sheet.raster.height) {
    return kBackground;
  }
  const double u = at.x() - x, v = at.y() - y;
  return (1 - v) * ((1 - u) * sheet.raster.at(x, y) + u * sheet.raster.at(x + 1, y)) +
         v * ((1 - u) * sheet.raster.at(x, y + 1) + u * sheet.raster.at(x + 1, y + 1));
}

/// Averages samples x samples rays a pixel; grey noise of `noise` levels; 30 black to 220 white.
inline ByteImage photographSheet(const PrintedSheet& sheet, const Camera& camera,
                                 const Eigen::Isometry3d& world_from_board, double noise,
                                 std::mt19937_64& random, int samples = 3) {
  const CameraModel model = camera.model();
  const Eigen::Isometry3d board_from_camera =
      (camera.camera_from_world * world_from_board).inverse();
  std::normal_distribution<double> gaussian(0.0, noise);
  ByteImage out{camera.width_px, camera.height_px, {}};
  out.pixels.resize(static_cast<std::size_t>(out.width) * out.height);
  const Vec3 origin = board_from_camera.translation();
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      double sum = 0.0;
      for (int i = 0; i < samples * samples; ++i) {
        const Vec2 pixel(x - 0.5 + (i % samples + 0.5) / samples,
                         y - 0.5 + (i / samples + 0.5) / samples);
        const auto direction = model.normalized(pixel);
        const Vec3 ray = board_from_camera.linear() * direction->homogeneous();
        const Vec3 hit = origin - origin.z() / ray.z() * ray;
        sum += levelAt(sheet, hit.head<2>());
      }
      const double level = 30.0 + 190.0 / 255.0 * sum / (samples * samples) + gaussian(random);
      out.pixels[static_cast<std::size_t>(y) * out.width + x] =
          static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
    }
  }
  return out;
}

}  // namespace tenter::virtual_rig
