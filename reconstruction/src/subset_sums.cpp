// SPDX-License-Identifier: GPL-3.0-or-later
#include "subset_sums.h"

#include <algorithm>
#include <cmath>

#include "float4.h"

namespace tenter {

namespace {

constexpr int kLanes = 4;

/// Adds row sums of `row * a^i`, times powers of b, to the six sums of monomials.
void addRow(std::array<double, 6>& sums, double by_1, double by_a, double by_a2, double b) {
  sums[0] += by_1;
  sums[1] += by_a;
  sums[2] += by_1 * b;
  sums[3] += 0.5 * by_a2;
  sums[4] += by_a * b;
  sums[5] += 0.5 * by_1 * b * b;
}

/// Sums over a row of left * right * a^i, i = 0..4.
std::array<double, 5> rowMoments(const SubsetGrid& grid, const float* left, const float* right) {
  Float4 m0{}, m1{}, m2{}, m3{}, m4{};
  for (int k = 0; k < grid.stride; k += kLanes) {
    const Float4 a = load4(&grid.a[k]), a2 = load4(&grid.a2[k]);
    const Float4 product = load4(left + k) * load4(right + k);
    const Float4 by_a2 = product * a2;
    m0 += product;
    m1 += product * a;
    m2 += by_a2;
    m3 += by_a2 * a;
    m4 += by_a2 * a2;
  }
  return {sum(m0), sum(m1), sum(m2), sum(m3), sum(m4)};
}

void addMoments(Moments& moments, const std::array<double, 5>& row, double b, int degree) {
  double power = 1.0;
  for (int j = 0; j <= degree; ++j, power *= b) {
    for (int i = 0; i + j <= degree; ++i) moments[i][j] += row[i] * power;
  }
}

double ordinate(const SubsetGrid& grid, int row) {
  return static_cast<double>(row - grid.radius) / grid.radius;
}

}  // namespace

SubsetGrid::SubsetGrid(int side_px)
    : side(side_px), radius(side_px / 2), stride((side_px + kLanes - 1) / kLanes * kLanes) {
  for (int k = 0; k < stride; ++k) {
    const auto offset = static_cast<float>(std::min(k, side - 1) - radius);
    dx.push_back(offset);
    a.push_back(offset / static_cast<float>(radius));
    a2.push_back(a.back() * a.back());
    inside.push_back(k < side ? 1.0F : 0.0F);
  }
}

std::array<double, 6> monomialsAt(const Vec2& ab) {
  const double a = ab.x(), b = ab.y();
  return {1.0, a, b, 0.5 * a * a, a * b, 0.5 * b * b};
}

double removeMean(const SubsetGrid& grid, std::span<float> values) {
  double total = 0.0;
  for (int row = 0; row < grid.side; ++row) {
    float* v = &values[static_cast<std::size_t>(row) * grid.stride];
    Float4 sums{};
    for (int k = 0; k < grid.stride; k += kLanes) sums += load4(v + k) * load4(&grid.inside[k]);
    total += sum(sums);
  }
  const auto mean = static_cast<float>(total / grid.count());
  double squares = 0.0;
  for (int row = 0; row < grid.side; ++row) {
    float* v = &values[static_cast<std::size_t>(row) * grid.stride];
    Float4 sums{};
    for (int k = 0; k < grid.stride; k += kLanes) {
      const Float4 centred = (load4(v + k) - mean) * load4(&grid.inside[k]);
      store4(v + k, centred);
      sums += centred * centred;
    }
    squares += sum(sums);
  }
  return std::sqrt(squares);
}

double dot(const SubsetGrid& grid, std::span<const float> left, std::span<const float> right) {
  double total = 0.0;
  for (int row = 0; row < grid.side; ++row) {
    const std::size_t begin = static_cast<std::size_t>(row) * grid.stride;
    Float4 sums{};
    for (int k = 0; k < grid.stride; k += kLanes) {
      sums += load4(&left[begin + k]) * load4(&right[begin + k]);
    }
    total += sum(sums);
  }
  return total;
}

void subtractFrom(std::span<const float> f, float factor, std::span<float> values) {
  for (std::size_t k = 0; k < values.size(); k += kLanes) {
    store4(&values[k], load4(&f[k]) - factor * load4(&values[k]));
  }
}

GradientMoments gradientMoments(const SubsetGrid& grid, std::span<const float> gx,
                                std::span<const float> gy, int degree) {
  GradientMoments moments;
  for (int row = 0; row < grid.side; ++row) {
    const std::size_t begin = static_cast<std::size_t>(row) * grid.stride;
    const float *x = &gx[begin], *y = &gy[begin];
    const double b = ordinate(grid, row);
    addMoments(moments.xx, rowMoments(grid, x, x), b, degree);
    addMoments(moments.xy, rowMoments(grid, x, y), b, degree);
    addMoments(moments.yy, rowMoments(grid, y, y), b, degree);
  }
  return moments;
}

std::array<double, 6> projectOn(const SubsetGrid& grid, std::span<const float> values,
                                std::span<const float> slopes) {
  std::array<double, 6> sums{};
  for (int row = 0; row < grid.side; ++row) {
    const std::size_t begin = static_cast<std::size_t>(row) * grid.stride;
    Float4 by_1{}, by_a{}, by_a2{};
    for (int k = 0; k < grid.stride; k += kLanes) {
      const Float4 product = load4(&values[begin + k]) * load4(&slopes[begin + k]);
      by_1 += product;
      by_a += product * load4(&grid.a[k]);
      by_a2 += product * load4(&grid.a2[k]);
    }
    addRow(sums, sum(by_1), sum(by_a), sum(by_a2), ordinate(grid, row));
  }
  return sums;
}

std::array<double, 6> projectOnes(const SubsetGrid& grid, std::span<const float> slopes) {
  std::array<double, 6> sums{};
  for (int row = 0; row < grid.side; ++row) {
    const std::size_t begin = static_cast<std::size_t>(row) * grid.stride;
    Float4 by_1{}, by_a{}, by_a2{};
    for (int k = 0; k < grid.stride; k += kLanes) {
      const Float4 slope = load4(&slopes[begin + k]);
      by_1 += slope;
      by_a += slope * load4(&grid.a[k]);
      by_a2 += slope * load4(&grid.a2[k]);
    }
    addRow(sums, sum(by_1), sum(by_a), sum(by_a2), ordinate(grid, row));
  }
  return sums;
}

Extent warpedPlaces(const SubsetGrid& grid, const SubsetWarp::Polynomial& p, double centre,
                    bool along_x, std::span<float> places) {
  Float4 least = Float4{} + 1e30F, most = Float4{} - 1e30F;
  for (int row = 0; row < grid.side; ++row) {
    const double dy = row - grid.radius;
    const auto constant =
        static_cast<float>(centre + (along_x ? 0.0 : dy) + p[2] * dy + 0.5 * p[5] * dy * dy);
    const auto slope = static_cast<float>((along_x ? 1.0 : 0.0) + p[1] + p[4] * dy);
    const auto curvature = static_cast<float>(0.5 * p[3]);
    float* out = &places[static_cast<std::size_t>(row) * grid.stride];
    for (int k = 0; k < grid.stride; k += kLanes) {
      const Float4 dx = load4(&grid.dx[k]);
      const Float4 place = (curvature * dx + slope) * dx + constant;
      store4(out + k, place);
      least = place < least ? place : least;
      most = place > most ? place : most;
    }
  }
  return {std::min({least[0], least[1], least[2], least[3]}),
          std::max({most[0], most[1], most[2], most[3]})};
}

double meanNoiseGain(const SubsetGrid& grid, const SubsetWarp& warp, int cx, int cy) {
  constexpr int kSamples = 5;
  const auto offsetOf = [&](int k) {
    return std::round(0.9 * grid.radius * (2.0 * k / (kSamples - 1) - 1.0));
  };
  double total = 0.0;
  for (int row = 0; row < kSamples; ++row) {
    for (int column = 0; column < kSamples; ++column) {
      const Vec2 offset(offsetOf(column), offsetOf(row));
      const Vec2 place = Vec2(cx, cy) + offset + warp.displacementAt(offset);
      total += smoothedNoiseGain(place.x()) * smoothedNoiseGain(place.y());
    }
  }
  return total / (kSamples * kSamples);
}

double smoothedSquares(const SubsetGrid& grid, std::span<const float> values,
                       std::span<float> row) {
  double total = 0.0;
  for (int y = 1; y + 1 < grid.side; ++y) {
    const float* v = &values[static_cast<std::size_t>(y) * grid.stride];
    for (int k = 0; k < grid.stride; k += kLanes) {
      store4(&row[k],
             load4(v + k - grid.stride) + 2.0F * load4(v + k) + load4(v + k + grid.stride));
    }
    Float4 sums{};
    int k = 1;
    for (; k + kLanes < grid.side; k += kLanes) {
      const Float4 smooth = load4(&row[k - 1]) + 2.0F * load4(&row[k]) + load4(&row[k + 1]);
      sums += smooth * smooth;
    }
    total += sum(sums);
    for (; k + 1 < grid.side; ++k) {
      const float smooth = row[k - 1] + 2.0F * row[k] + row[k + 1];
      total += smooth * smooth;
    }
  }
  return total / (16.0 * 16.0);
}

}  // namespace tenter
