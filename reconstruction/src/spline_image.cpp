// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/spline_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

#include "float4.h"

namespace tenter {

namespace {

/// Pole of the filter that turns samples into coefficients, sqrt(3) - 2 [Uns93].
constexpr float kPole = -0.26794919243F;
/// The pole's powers are below single precision after so many pixels.
constexpr int kHorizon = 16;

/// Index into [0, n) of the image continued by mirroring at its outermost pixels.
int mirrored(int i, int n) {
  if (i < 0) i = -i;
  if (i >= n) i = 2 * (n - 1) - i;
  return std::clamp(i, 0, n - 1);
}

/// Turns samples into coefficients along one direction; `line(i)` is the i-th row of `count`
/// values that are filtered side by side.
template <class Line>
void toCoefficients(int length, int count, Line line) {
  const auto addScaled = [count](float* to, const float* from, float factor) {
    for (int k = 0; k < count; ++k) to[k] += factor * from[k];
  };
  float power = kPole;
  for (int i = 1; i < std::min(length, kHorizon); ++i, power *= kPole) {
    addScaled(line(0), line(i), power);
  }
  for (int i = 1; i < length; ++i) addScaled(line(i), line(i - 1), kPole);
  constexpr float kEnd = kPole / (kPole * kPole - 1.0F);
  float* last = line(length - 1);
  const float* before = line(length - 2);
  for (int k = 0; k < count; ++k) last[k] = kEnd * (last[k] + kPole * before[k]);
  for (int i = length - 2; i >= 0; --i) {
    float* here = line(i);
    const float* next = line(i + 1);
    for (int k = 0; k < count; ++k) here[k] = kPole * (next[k] - here[k]);
  }
  for (int i = 0; i < length; ++i) {
    for (int k = 0; k < count; ++k) line(i)[k] *= 6.0F;
  }
}

/// Weights of four coefficients at the fraction t between the second and the third.
Float4 weights(float t) {
  constexpr Float4 kCube = {-1.0F / 6.0F, 0.5F, -0.5F, 1.0F / 6.0F};
  constexpr Float4 kSquare = {0.5F, -1.0F, 0.5F, 0.0F};
  constexpr Float4 kLinear = {-0.5F, 0.0F, 0.5F, 0.0F};
  constexpr Float4 kConstant = {1.0F / 6.0F, 4.0F / 6.0F, 1.0F / 6.0F, 0.0F};
  return ((kCube * t + kSquare) * t + kLinear) * t + kConstant;
}

float weighted(const float* corner, std::size_t stride, float tx, float ty) {
  const Float4 wy = weights(ty);
  const Float4 columns = (wy[0] * load4(corner) + wy[1] * load4(corner + stride)) +
                         (wy[2] * load4(corner + 2 * stride) + wy[3] * load4(corner + 3 * stride));
  return sum(weights(tx) * columns);
}

/// By [1 2 1] / 4 in both directions; the outermost pixels become 0.
std::vector<float> smoothed(const std::vector<float>& values, int width, int height) {
  std::vector<float> result(values.size());
  for (int y = 1; y + 1 < height; ++y) {
    for (int x = 1; x + 1 < width; ++x) {
      const float* v = &values[static_cast<std::size_t>(y) * width + x];
      const auto column = [v, width](int dx) {
        return v[dx - width] + 2.0F * v[dx] + v[dx + width];
      };
      result[static_cast<std::size_t>(y) * width + x] =
          (column(-1) + 2.0F * column(0) + column(1)) / 16.0F;
    }
  }
  return result;
}

double dot(const std::vector<float>& left, const std::vector<float>& right) {
  return std::inner_product(left.begin(), left.end(), right.begin(), 0.0);
}

}  // namespace

SplineImage::SplineImage(const GrayImage& image)
    : width_(image.width),
      height_(image.height),
      stride_(static_cast<std::size_t>(image.width + 2 * kMargin)),
      coefficients_(stride_ * static_cast<std::size_t>(image.height + 2 * kMargin)) {
  require(width_ >= 2 && height_ >= 2, "a spline needs two pixels a side");
  const auto row = [this](int y) { return const_cast<float*>(coefficient(0, y)); };
  for (int y = 0; y < height_; ++y) {
    std::copy_n(&image.pixels[static_cast<std::size_t>(y) * width_], width_, row(y));
    toCoefficients(width_, 1, [&](int x) { return row(y) + x; });
  }
  toCoefficients(height_, width_, row);
  for (int y = -kMargin; y < height_ + kMargin; ++y) {
    const int source = mirrored(y, height_);
    if (source != y) std::copy_n(row(source), width_, row(y));
    for (int k = 1; k <= kMargin; ++k) {
      row(y)[-k] = row(y)[mirrored(-k, width_)];
      row(y)[width_ - 1 + k] = row(y)[mirrored(width_ - 1 + k, width_)];
    }
  }
}

float SplineImage::value(double x, double y) const {
  const double floor_x = std::floor(x), floor_y = std::floor(y);
  return weighted(coefficient(static_cast<int>(floor_x) - 1, static_cast<int>(floor_y) - 1),
                  stride_, static_cast<float>(x - floor_x), static_cast<float>(y - floor_y));
}

void SplineImage::sample(int base_x, int base_y, std::span<const float> x, std::span<const float> y,
                         std::span<float> values) const {
  const auto stride = static_cast<std::ptrdiff_t>(stride_);
  const std::ptrdiff_t origin = stride * (base_y - 1 + kMargin) + base_x - 1 + kMargin;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const int whole_x = static_cast<int>(x[i]), whole_y = static_cast<int>(y[i]);
    values[i] = weighted(coefficients_.data() + (origin + stride * whole_y + whole_x), stride_,
                         x[i] - static_cast<float>(whole_x), y[i] - static_cast<float>(whole_y));
  }
}

GradientImage::GradientImage(GrayImage image)
    : image_(std::move(image)), slopes_x_(image_.pixels.size()), slopes_y_(image_.pixels.size()) {
  const SplineImage spline(image_);
  const auto stride = static_cast<std::ptrdiff_t>(spline.stride_);
  std::vector<float> sharp_x(image_.pixels.size()), sharp_y(image_.pixels.size());
  for (int y = 0; y < height(); ++y) {
    const float* c = spline.coefficient(0, y);
    for (int x = 0; x < width(); ++x, ++c) {
      const auto across = [c](std::ptrdiff_t row) { return c[row + 1] - c[row - 1]; };
      const auto down = [c, stride](std::ptrdiff_t side) {
        return c[stride + side] - c[-stride + side];
      };
      sharp_x[index(x, y)] = (across(-stride) + 4.0F * across(0) + across(stride)) / 12.0F;
      sharp_y[index(x, y)] = (down(-1) + 4.0F * down(0) + down(1)) / 12.0F;
    }
  }
  for (int y = 0; y < height(); ++y) {
    const int above = std::max(y - 1, 0), below = std::min(y + 1, height() - 1);
    for (int x = 0; x < width(); ++x) {
      const int left = std::max(x - 1, 0), right = std::min(x + 1, width() - 1);
      const std::size_t here = index(x, y);
      slopes_x_[here] =
          0.25F * (sharp_x[index(left, y)] + 2.0F * sharp_x[here] + sharp_x[index(right, y)]);
      slopes_y_[here] =
          0.25F * (sharp_y[index(x, above)] + 2.0F * sharp_y[here] + sharp_y[index(x, below)]);
    }
  }
  const double smooth = dot(slopes_x_, slopes_x_) + dot(slopes_y_, slopes_y_);
  const double crossed = dot(slopes_x_, sharp_x) + dot(slopes_y_, sharp_y);
  if (!(smooth > 0.0)) return;
  sharpness_ = crossed / smooth;
  const std::vector<float> x = smoothed(slopes_x_, width(), height());
  const std::vector<float> y = smoothed(slopes_y_, width(), height());
  smoothed_share_ = (dot(x, x) + dot(y, y)) / smooth;
}

double smoothedNoiseGain(double t) {
  constexpr int kSteps = 64;
  static const auto kTable = [] {
    std::array<double, kSteps + 1> table{};
    for (int step = 0; step <= kSteps; ++step) {
      const Float4 w = weights(static_cast<float>(step) / kSteps);
      constexpr int kFrequencies = 256;
      double passed = 0.0, whole = 0.0;
      for (int f = 0; f < kFrequencies; ++f) {
        const double omega = std::numbers::pi * (f + 0.5) / kFrequencies;
        const std::complex<double> turn = std::polar(1.0, omega);
        const std::complex<double> between =
            double{w[0]} + turn * (double{w[1]} + turn * (double{w[2]} + turn * double{w[3]}));
        const double samples = (4.0 + 2.0 * std::cos(omega)) / 6.0;
        const double smoothing = 0.5 * (1.0 + std::cos(omega));
        passed += smoothing * smoothing * std::norm(between) / (samples * samples);
        whole += smoothing * smoothing;
      }
      table[step] = passed / whole;
    }
    return table;
  }();
  const double place = (t - std::floor(t)) * kSteps;
  const int step = std::min(static_cast<int>(place), kSteps - 1);
  return kTable[step] + (place - step) * (kTable[step + 1] - kTable[step]);
}

}  // namespace tenter
