// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "frame_evaluator.h"

namespace tenter {

/// Weak belief about what the data cannot see ([Est12] has none): every coefficient within
/// kPriorRelativeStd of the group's typical stiffness of its best constant, and curves as smooth
/// (SplineBasis::roughness). It is measured in the noise that the data show: data that are met to
/// rounding leave nothing of it. Residuals are `matrix` z - `offset`.
struct Prior {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd offset;
};
inline constexpr double kPriorRelativeStd = 2.0;
/// @param misfit  sum of squares per residual.
Prior weakPrior(const FitSpace& space, double misfit);

struct OuterOptions {
  /// Each rejection shortens the step by twice as much as the last: after five there is nothing to
  /// gain.
  int max_rejected_steps = 5;
  double relative_tolerance =
      1e-2;  ///< Stop when the cost falls by less between iterations ([Est12] sec. 5.1).
  int max_iterations = 30;
  /// Of the trust region: the first step is damped by 1 / radius of the diagonal. Ceres' own 1e4
  /// leaves so little of it that several rejections in a row would change nothing, and each costs a
  /// set of equilibria.
  double first_radius = 100.0;
  double misfit = 1.0;  ///< Sum of squares per residual, for the weak belief.
  std::function<void(int iteration, double cost)> progress;
};

struct OuterSummary {
  Eigen::VectorXd z;  ///< Best point, also when cancelled or not converged.
  double initial_cost = 0.0;
  double cost = 0.0;    ///< Of the data, half the sum of squares.
  double radius = 0.0;  ///< Of the trust region after the last accepted step.
  int iterations = 0;
  int failed_points = 0;  ///< Trial points where a frame had no equilibrium.
  bool converged = false;
  bool blocked = false;  ///< Ended because the shortest step, too, had a frame without equilibrium.
  bool usable = false;   ///< False when not even the start could be evaluated.
};

/// min over z >= bounds of the sum of squares of the evaluator's frames, by Ceres' trust region
/// (Levenberg-Marquardt). On return the evaluator's accepted states are those of the best point.
OuterSummary solveOuter(FrameEvaluator& evaluator, const Eigen::VectorXd& start,
                        const OuterOptions& options);

}  // namespace tenter
