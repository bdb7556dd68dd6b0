// SPDX-License-Identifier: GPL-3.0-or-later
// Sums over the pixels of a subset. Values are in grey levels, offsets from the centre are divided
// by the radius, (a, b) in [-1, 1]^2. Monomials: 1, a, b, a^2/2, ab, b^2/2. Nothing allocates.
#pragma once

#include <array>
#include <span>

#include "subset_grid.h"
#include "tenter/core/types.h"
#include "tenter/reconstruction/spline_image.h"
#include "tenter/reconstruction/subset_warp.h"

namespace tenter {

/// Sums of products of two slopes with a^i b^j, i + j <= 4.
using Moments = std::array<std::array<double, 5>, 5>;
struct GradientMoments {
  Moments xx{}, xy{}, yy{};
};

struct Monomial {
  int i, j;  ///< a^i b^j
  double factor;
};
inline constexpr std::array<Monomial, 6> kMonomials = {
    {{0, 0, 1.0}, {1, 0, 1.0}, {0, 1, 1.0}, {2, 0, 0.5}, {1, 1, 1.0}, {0, 2, 0.5}}};

/// The monomials at (a, b).
std::array<double, 6> monomialsAt(const Vec2& ab);

/// Subtracts the mean, zeroes the padding; returns the norm of what is left.
double removeMean(const SubsetGrid& grid, std::span<float> values);

double dot(const SubsetGrid& grid, std::span<const float> left, std::span<const float> right);

/// values = f - factor * values.
void subtractFrom(std::span<const float> f, float factor, std::span<float> values);

GradientMoments gradientMoments(const SubsetGrid& grid, std::span<const float> gx,
                                std::span<const float> gy, int degree);

/// Sums of values * slopes * each monomial. Without `slopes`' padding at 0 the sums are wrong.
std::array<double, 6> projectOn(const SubsetGrid& grid, std::span<const float> values,
                                std::span<const float> slopes);

/// Sums of slopes * each monomial.
std::array<double, 6> projectOnes(const SubsetGrid& grid, std::span<const float> slopes);

struct Extent {
  float min, max;
};

/// centre + offset along the axis + p(offset) - p(0) for every pixel; `along_x` says which axis.
Extent warpedPlaces(const SubsetGrid& grid, const SubsetWarp::Polynomial& p, double centre,
                    bool along_x, std::span<float> places);

/// Mean over the subset around the pixel (cx, cy) of what interpolation leaves of smoothed noise.
double meanNoiseGain(const SubsetGrid& grid, const SubsetWarp& warp, int cx, int cy);

/// Share of the variance of white noise that [1 2 1] / 4 in both directions leaves.
inline constexpr double kSmoothingGain = 0.375 * 0.375;

/// Sum of squares, over all but the outermost pixels, of values smoothed by [1 2 1] / 4 in both
/// directions. `row` has room for one row.
double smoothedSquares(const SubsetGrid& grid, std::span<const float> values, std::span<float> row);

}  // namespace tenter
