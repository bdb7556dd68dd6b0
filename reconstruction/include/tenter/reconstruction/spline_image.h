// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "tenter/reconstruction/gray_image.h"

namespace tenter {

/// An image between its pixels: the cubic B-spline that passes through all of them [Uns93],
/// mirrored at the border. Defined on [0, width - 1] x [0, height - 1].
class SplineImage {
 public:
  explicit SplineImage(const GrayImage& image);

  int width() const { return width_; }
  int height() const { return height_; }

  /// Precondition: the place is inside.
  float value(double x, double y) const;

  /// Values at (base_x + x[i], base_y + y[i]) [grey levels]. Single precision suffices for offsets
  /// from a near base, not for places in a large image. Never allocates. Precondition: all places
  /// are inside, and x and y not below 0.
  void sample(int base_x, int base_y, std::span<const float> x, std::span<const float> y,
              std::span<float> values) const;

 private:
  friend class GradientImage;
  const float* coefficient(int x, int y) const {
    return coefficients_.data() + static_cast<std::size_t>(y + kMargin) * stride_ + x + kMargin;
  }

  static constexpr int kMargin = 2;  ///< Coefficients that stand outside the image, each side.
  int width_, height_;
  std::size_t stride_;
  std::vector<float> coefficients_;
};

/// An image with its derivatives at the pixels: what a reference needs. They are those of the
/// spline, each smoothed along its own direction by [1 2 1] / 4. What they do not see cannot bias a
/// match: at the finest scales, interpolation is wrong (docs/correlation.md).
class GradientImage {
 public:
  explicit GradientImage(GrayImage image);

  const GrayImage& image() const { return image_; }
  int width() const { return image_.width; }
  int height() const { return image_.height; }
  const float* values(int x, int y) const { return &image_.pixels[index(x, y)]; }
  const float* slopesX(int x, int y) const { return &slopes_x_[index(x, y)]; }
  const float* slopesY(int x, int y) const { return &slopes_y_[index(x, y)]; }
  /// Mean of the spline's derivatives times the smoothed ones, over the mean square of these.
  double sharpness() const { return sharpness_; }
  /// Share of the derivatives' mean square that smoothing by [1 2 1] / 4 in x and y leaves.
  double smoothedShare() const { return smoothed_share_; }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(image_.width) + x;
  }

  GrayImage image_;
  std::vector<float> slopes_x_, slopes_y_;  ///< [grey levels/px]
  double sharpness_ = 1.0, smoothed_share_ = 1.0;
};

/// White noise at the pixels, smoothed by [1 2 1] / 4 in one direction: the share of its variance
/// that is left if it is first interpolated at the fraction t of a pixel. The product of both
/// directions is that of a place. 1 at the pixels, least at t = 1/2.
double smoothedNoiseGain(double t);

}  // namespace tenter
