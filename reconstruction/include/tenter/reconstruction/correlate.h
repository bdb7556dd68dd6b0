// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/reconstruction/subset_matcher.h"

namespace tenter {

/// Why a point counts, or does not.
enum class PointState {
  kValid,
  kOutside,         ///< Its subset leaves one of the images.
  kNoTexture,       ///< Nothing in its subset can be found again.
  kSaturated,       ///< Too much of its subset is at an end of the grey scale.
  kNotFound,        ///< No place in the deformed image fits.
  kLowCorrelation,  ///< The best place fits too badly.
  kUncertain,       ///< Its sigma is too large.
  kAmbiguous,       ///< The texture repeats: several places fit.
  kOutlier,         ///< It contradicts its neighbours, or has none.
};
inline constexpr int kPointStates = 9;

/// "valid", "outside", "no_texture", ... as in files.
std::string_view nameOf(PointState state);

struct CorrelateOptions {
  MatchOptions match;
  double min_zncc = 0.75;
  double max_sigma_px = 0.1;
  int threads = 1;
  /// Asked now and then with the share of work done; false stops and what is left is kNotFound.
  std::function<bool(double)> keep_going;
};

struct CorrelatedPoint {
  Vec2 position;  ///< In the reference [px].
  PointState state = PointState::kNotFound;
  SubsetMatch match;  ///< Around the position; only `zncc` means something unless valid.

  bool valid() const { return state == PointState::kValid; }
  /// Root mean square of the standard deviations of u and v [px].
  double sigma_px() const;
};

struct CorrelationField {
  std::vector<CorrelatedPoint> points;  ///< In the order in which they were asked for.
  std::vector<std::string> warnings;    ///< About the images as a whole.
  double seconds = 0.0;                 ///< Of the clock.
  double cpu_seconds = 0.0;             ///< Of all threads together.

  std::size_t count(PointState state) const;
};

/// Points of a regular grid whose subsets lie in an image of this size, row by row.
std::vector<Vec2> gridPoints(int width, int height, int subset_px, int step_px);

/// Displacements of the pieces of `reference` around a regular grid of points, at least one.
/// A match begins at seeds that are searched for in the whole deformed image, turned by up to 48
/// degrees and stretched by up to 15 %, and spreads from the best matched points to their
/// neighbours. Error if the images differ in size or are too small for one subset.
Result<CorrelationField> correlateGrid(const GrayImage& reference, const GrayImage& deformed,
                                       int step_px, const CorrelateOptions& options);

/// The same around any points inside the reference, by means of a grid that covers them.
Result<CorrelationField> correlatePoints(const GrayImage& reference, const GrayImage& deformed,
                                         const std::vector<Vec2>& points,
                                         const CorrelateOptions& options);

}  // namespace tenter
