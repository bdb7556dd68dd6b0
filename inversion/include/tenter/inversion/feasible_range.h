// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "tenter/inversion/inversion.h"

namespace tenter {

/// One inversion of a search.
struct RangePoint {
  double stiffness_factor = 1.0;
  double friction_factor = 1.0;
  InversionStatus status = InversionStatus::kNotConverged;
  double lambda_min_per_s2 = 0.0;  ///< NaN where it was not computed.
};

/// Which multiples of a problem's stiffness and friction have a certified rest shape.
struct FeasibleRange {
  /// Softest and stiffest certified multiples of all stiffness, at the given friction; empty if
  /// none was found.
  std::optional<double> stiffness_min, stiffness_max;
  /// The multiple below `stiffness_min` that was tried and not certified; empty if the search ended
  /// at its own bound.
  std::optional<double> stiffness_below;
  /// Smallest certified multiple of the friction, at `friction_at_stiffness` times the stiffness,
  /// and the largest below it that was not certified. More friction only widens the cones, so
  /// there is no upper end.
  std::optional<double> friction_min, friction_below;
  double friction_at_stiffness = 1.0;
  /// Multiples of the friction below this are proved to have no rest shape, whatever the stiffness;
  /// 0: nothing is proved, infinity: none has one.
  double friction_proved_below = 0.0;
  std::vector<RangePoint> points;  ///< Everything that was tried, in order.
  bool complete = false;           ///< Neither time nor the user ended it.
  /// The inversion at multiple 1 if that is certified, otherwise at the certified multiple nearest
  /// to it, otherwise at 1; and which multiple of the stiffness that is.
  InversionResult result;
  double result_stiffness = 1.0;
};

/// Bounds of the search, and the ratio to which it narrows an end down.
inline constexpr double kSoftestFactor = 1.0 / 64.0, kStiffestFactor = 64.0;
inline constexpr double kRangeRatio = 1.1;

/// The same material with all stresses times `factor`.
ShellMaterial scaled(const ShellMaterial& material, double factor);

/// Searches by doubling and halving from 1, then by bisection in the logarithm. Error as invert().
Result<FeasibleRange> findFeasibleRange(const InversionProblem& problem,
                                        const InversionOptions& options);

}  // namespace tenter
