// SPDX-License-Identifier: GPL-3.0-or-later
#include "exposure.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "random_numbers.h"

namespace tenter {
namespace {

constexpr double kWhiteLevel = 0.8;  // of the range, at exposure 1

/// SplitMix64: well mixed bits of a counter.
std::uint64_t mixed(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

/// One row of a picture.
class RowExposure {
 public:
  RowExposure(const RayScene& scene, const VirtualCamera& camera, const PixelDirections& directions,
              const RenderOptions& options, std::uint64_t number)
      : scene_(scene),
        camera_(camera),
        directions_(directions),
        options_(options),
        number_(number),
        rig_from_camera_(camera.camera_from_rig.inverse()),
        size_per_depth_(1.0 / camera.model.lens().fx_px / options.samples) {}

  void expose(int row, std::uint8_t* pixels) const {
    RandomNumbers random(options_.seed, "pixels " + camera_.name + " " + std::to_string(number_) +
                                            " " + std::to_string(row));
    const double electrons = options_.full_well_e * kWhiteLevel * camera_.exposure / kWhiteAlbedo;
    for (int column = 0; column < camera_.model.widthPx(); ++column) {
      double charge = electrons * light(column, row);
      if (options_.noise) {
        charge += std::hypot(std::sqrt(charge), options_.read_noise_e) * random.normal();
      }
      const double grey = 255.0 * charge / options_.full_well_e;
      pixels[column] = static_cast<std::uint8_t>(std::lround(std::clamp(grey, 0.0, 255.0)));
    }
  }

 private:
  double light(int column, int row) const {
    const int n = options_.samples, rays = n * n;
    const std::uint64_t pixel =
        static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(camera_.model.widthPx()) +
        static_cast<std::uint64_t>(column);
    const double turn = static_cast<double>(mixed(pixel) >> 11) * 0x1p-53;
    double sum = 0.0;
    for (int k = 0; k < rays; ++k) {
      const double x = column + (k % n + 0.5) / n - 0.5, y = row + (k / n + 0.5) / n - 0.5;
      sum += ray(x, y, 2.0 * std::numbers::pi * (turn + static_cast<double>(k) / rays));
    }
    return sum / rays;
  }

  double ray(double x, double y, double angle) const {
    const Vec2 seen = directions_.at(x, y);
    if (!seen.allFinite()) return 0.0;
    // A ring of this radius blurs as much as the whole pupil does.
    const double radius = 0.5 * camera_.aperture_m * std::numbers::sqrt2 / 2.0;
    const Vec3 from(radius * std::cos(angle), radius * std::sin(angle), 0.0);
    const Vec3 along(seen.x() - from.x() / camera_.focus_m, seen.y() - from.y() / camera_.focus_m,
                     1.0);
    return scene_.radiance((rig_from_camera_ * from).cast<float>(),
                           (rig_from_camera_.linear() * along).cast<float>(), size_per_depth_);
  }

  const RayScene& scene_;
  const VirtualCamera& camera_;
  const PixelDirections& directions_;
  const RenderOptions& options_;
  std::uint64_t number_;
  Eigen::Isometry3d rig_from_camera_;
  double size_per_depth_;
};

}  // namespace

PixelDirections::PixelDirections(const CameraModel& model)
    : columns_(model.widthPx() / kSpacing_px + 2) {
  const int rows = model.heightPx() / kSpacing_px + 2;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  table_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows),
                Vec2::Constant(kNone));
  tbb::parallel_for(tbb::blocked_range<int>(0, rows), [&](const tbb::blocked_range<int>& range) {
    for (int j = range.begin(); j < range.end(); ++j) {
      for (int i = 0; i < columns_; ++i) {
        const auto place = model.normalized(Vec2(kSpacing_px * i - 0.5, kSpacing_px * j - 0.5));
        if (place) {
          table_[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) +
                 static_cast<std::size_t>(i)] = *place;
        }
      }
    }
  });
}

Eigen::Vector2d PixelDirections::at(double x, double y) const {
  const double column = (x + 0.5) / kSpacing_px, row = (y + 0.5) / kSpacing_px;
  const int i = static_cast<int>(column), j = static_cast<int>(row);
  const double s = column - i, t = row - j;
  const Vec2* corner = &table_[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) +
                               static_cast<std::size_t>(i)];
  const Vec2 upper = corner[0] + s * (corner[1] - corner[0]);
  const Vec2 lower = corner[columns_] + s * (corner[columns_ + 1] - corner[columns_]);
  return upper + t * (lower - upper);
}

ByteImage expose(const RayScene& scene, const VirtualCamera& camera,
                 const PixelDirections& directions, const RenderOptions& options,
                 std::uint64_t number) {
  ByteImage image{camera.model.widthPx(), camera.model.heightPx(), {}};
  image.pixels.resize(static_cast<std::size_t>(image.width) *
                      static_cast<std::size_t>(image.height));
  const RowExposure rows(scene, camera, directions, options, number);
  tbb::parallel_for(
      tbb::blocked_range<int>(0, image.height, 8), [&](const tbb::blocked_range<int>& range) {
        for (int row = range.begin(); row < range.end(); ++row) {
          rows.expose(row, image.pixels.data() + static_cast<std::size_t>(row) *
                                                     static_cast<std::size_t>(image.width));
        }
      });
  return image;
}

}  // namespace tenter
