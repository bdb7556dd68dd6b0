// SPDX-License-Identifier: GPL-3.0-or-later
// Images whose motion is known exactly, without a correlator's own interpolation in their making.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "tenter/core/types.h"
#include "tenter/reconstruction/gray_image.h"

namespace tenter::reconstruction_test {

/// A texture that is defined everywhere: cubic B-splines on three random lattices.
class SpeckleTexture {
 public:
  explicit SpeckleTexture(unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    for (auto& lattice : lattices_) {
      lattice.resize(kSide * kSide);
      for (float& node : lattice) node = normal(random);
    }
  }

  /// Grey level, around 128 with a standard deviation near 40.
  double at(const Vec2& place) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < lattices_.size(); ++k) {
      sum += kAmplitudes[k] * octave(lattices_[k], place / kPitches_px[k]);
    }
    return 128.0 + 50.0 * sum;
  }

 private:
  static std::array<double, 4> weights(double t) {
    const double s = 1.0 - t;
    return {s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
            (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0, t * t * t / 6.0};
  }
  static int wrapped(int i) { return ((i % kSide) + kSide) % kSide; }
  static double octave(const std::vector<float>& lattice, const Vec2& place) {
    const double fx = std::floor(place.x()), fy = std::floor(place.y());
    const auto wx = weights(place.x() - fx), wy = weights(place.y() - fy);
    double sum = 0.0;
    for (int j = 0; j < 4; ++j) {
      const int row = kSide * wrapped(static_cast<int>(fy) - 1 + j);
      for (int i = 0; i < 4; ++i) {
        sum += wx[i] * wy[j] *
               static_cast<double>(lattice[row + wrapped(static_cast<int>(fx) - 1 + i)]);
      }
    }
    return sum;
  }

  static constexpr int kSide = 256;
  static constexpr std::array<double, 3> kPitches_px = {3.2, 5.1, 9.7};
  static constexpr std::array<double, 3> kAmplitudes = {1.0, 0.8, 0.5};
  std::array<std::vector<float>, 3> lattices_;
};

/// What a camera makes of grey levels: noise, rounding, the ends of the scale.
inline GrayImage photographed(GrayImage image, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, noise);
  for (float& pixel : image.pixels) {
    const double value = static_cast<double>(pixel) + (noise > 0.0 ? normal(random) : 0.0);
    pixel = static_cast<float>(std::clamp(std::round(value), 0.0, 255.0));
  }
  return image;
}

using PlaneMap = std::function<Vec2(const Vec2&)>;

/// The texture as seen where each pixel shows the material point `material(pixel)`.
inline GrayImage seen(
    const SpeckleTexture& texture, int width, int height,
    const PlaneMap& material = [](const Vec2& x) { return x; }) {
  GrayImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at(x, y) = static_cast<float>(texture.at(material(Vec2(x, y))));
    }
  }
  return image;
}

inline cv::Mat1d matrixOf(const GrayImage& image) {
  cv::Mat1d matrix(image.height, image.width);
  std::copy(image.pixels.begin(), image.pixels.end(), matrix.begin());
  return matrix;
}

inline GrayImage imageOf(const cv::Mat1d& matrix) {
  GrayImage image(matrix.cols, matrix.rows);
  std::transform(matrix.begin(), matrix.end(), image.pixels.begin(),
                 [](double value) { return static_cast<float>(value); });
  return image;
}

/// Every row moved along x by shift(y) [px], by the phases of its Fourier transform: exact for a
/// periodic, band-limited row, so near the left and right border it is not.
inline GrayImage rowsMoved(const GrayImage& image, const std::function<double(double)>& shift) {
  cv::Mat1d rows = matrixOf(image);
  cv::Mat spectrum;
  cv::dft(rows, spectrum, cv::DFT_ROWS | cv::DFT_COMPLEX_OUTPUT);
  const int width = image.width;
  for (int y = 0; y < image.height; ++y) {
    for (int k = 0; k < width; ++k) {
      const int signed_k = k <= width / 2 ? k : k - width;
      const double phase = -2.0 * std::numbers::pi * signed_k * shift(y) / width;
      auto& value = spectrum.at<cv::Vec2d>(y, k);
      const double re = value[0] * std::cos(phase) - value[1] * std::sin(phase);
      const double im = value[0] * std::sin(phase) + value[1] * std::cos(phase);
      value = 2 * k == width ? cv::Vec2d(re, 0.0) : cv::Vec2d(re, im);
    }
  }
  cv::idft(spectrum, rows, cv::DFT_ROWS | cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  return imageOf(rows);
}

inline GrayImage transposed(const GrayImage& image) {
  cv::Mat1d turned;
  cv::transpose(matrixOf(image), turned);
  return imageOf(turned);
}

}  // namespace tenter::reconstruction_test
