// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "tenter/reconstruction/spline_image.h"
#include "tenter/reconstruction/subset_warp.h"

namespace tenter {

struct SubsetGrid;

struct MatchOptions {
  int subset_px = 31;  ///< Side of the square subset, odd, 7 to 255.
  int order = 2;       ///< Of the warp: 1 or 2.
  int max_iterations = 30;
  /// Converged when a step moves no pixel of the subset by more than about this.
  double tolerance_px = 1e-3;
};

/// Error, by the names of the command line, unless the options can be used.
Result<void> checkMatchOptions(const MatchOptions& options);

enum class MatchEnd {
  kConverged,
  kOutside,       ///< The subset leaves one of the images.
  kNoTexture,     ///< Too little structure in the reference to be found again.
  kDiverged,      ///< Ran away by more than half the subset, or folded over.
  kNotConverged,  ///< Still moving after the last iteration.
};

struct SubsetMatch {
  MatchEnd end = MatchEnd::kNotConverged;
  SubsetWarp warp;  ///< Around the point; the guess if there is no match.
  /// Of (u, v) at the point [px^2], from the misfit and the gradients (docs/correlation.md).
  Mat2 covariance_px2 = Mat2::Constant(std::numeric_limits<double>::infinity());
  double zncc = 0.0;  ///< Zero-normalised cross-correlation, 1 if equal up to gain and offset.
  double gain = 0.0;  ///< Contrast in the deformed image over that in the reference.
  int iterations = 0;
};

/// Memory of one thread, so that matching never allocates.
struct MatchScratch {
  std::vector<float> f, gx, gy, x, y, g;
};

/// Finds square subsets of a reference image in deformed images by inverse-compositional
/// Gauss-Newton steps on the zero-normalised sum of squared differences [Bak04] [Pan13] [Gao15].
/// Holds a reference to the image, which must outlive it. Safe to use from several threads, each
/// with its own scratch.
class SubsetMatcher {
 public:
  /// Precondition: checkMatchOptions(options).
  SubsetMatcher(const GradientImage& reference, const MatchOptions& options);

  const MatchOptions& options() const { return options_; }

  /// Matches the subset around the pixel nearest to `point` [px], from `guess` around the point.
  SubsetMatch match(const SplineImage& deformed, const Vec2& point, const SubsetWarp& guess,
                    MatchScratch& scratch) const {
    return match(deformed, point, point, guess, scratch);
  }

  /// The same with the subset around the pixel nearest to `centre`: for points beside an edge,
  /// whose own subset would see beyond it. Guess and result are around the point.
  SubsetMatch match(const SplineImage& deformed, const Vec2& point, const Vec2& centre,
                    const SubsetWarp& guess, MatchScratch& scratch) const;

 private:
  const GradientImage& reference_;
  MatchOptions options_;
  std::shared_ptr<const SubsetGrid> grid_;
};

}  // namespace tenter
