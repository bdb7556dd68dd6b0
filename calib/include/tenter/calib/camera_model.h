// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>

#include "tenter/core/result.h"
#include "tenter/core/types.h"

namespace tenter {

/// Number of distortion coefficients a camera model carries, in OpenCV's order
/// (k1, k2, p1, p2, k3, k4, k5, k6). Calibration fits the first five.
inline constexpr int kDistortionTerms = 8;

/// Numbers of a pinhole camera with lens distortion [Bro71], docs/calibration.md eq. 1-3:
///   r^2 = x^2 + y^2,   radial = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
///   x_d = x radial + 2 p1 x y + p2 (r^2 + 2 x^2)
///   y_d = y radial + p1 (r^2 + 2 y^2) + 2 p2 x y
///   pixel = (fx x_d + cx, fy y_d + cy)
/// with (x, y) = (X / Z, Y / Z) in the camera's frame: x to the right of the image, y down, z
/// forward. The centre of the first pixel is (0, 0).
struct Lens {
  double fx_px = 0.0, fy_px = 0.0, cx_px = 0.0, cy_px = 0.0;
  std::array<double, kDistortionTerms> distortion{};
};

/// A checked camera: image size and lens. Cheap to copy; all functions are safe from any thread.
class CameraModel {
 public:
  /// Error (place names the field) unless sizes are 1 to 65536 px, all numbers are finite, focal
  /// lengths positive and the centre within ten image sizes.
  static Result<CameraModel> make(int width_px, int height_px, const Lens& lens);

  int widthPx() const { return width_px_; }
  int heightPx() const { return height_px_; }
  const Lens& lens() const { return lens_; }

  /// Pixel of a point in the camera's frame [m]; nothing if it lies behind the camera or so far off
  /// the axis that the distortion polynomial has folded over. May lie outside of the image.
  /// @param jacobian  2 x 3, d(pixel)/d(point) [px/m], written if not null.
  std::optional<Vec2> project(const Vec3& point_m,
                              Eigen::Matrix<double, 2, 3>* jacobian = nullptr) const;

  /// The inverse without depth: (X / Z, Y / Z) that projects to `pixel`, to 1e-12; nothing where
  /// the distortion has no inverse.
  std::optional<Vec2> normalized(const Vec2& pixel) const;

  /// Whether a pixel lies on the sensor, its border included: -0.5 <= x <= width - 0.5.
  bool contains(const Vec2& pixel) const;

  /// Largest r of the pinhole image at which the distortion still grows with r: beyond it two
  /// directions share a pixel.
  double radiusLimit() const { return radius_limit_; }

 private:
  CameraModel() = default;
  int width_px_ = 0, height_px_ = 0;
  Lens lens_;
  double radius_limit_ = 0.0;
};

}  // namespace tenter
