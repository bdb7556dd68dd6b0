// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fit_roles.h"
#include "frame_evaluator.h"

namespace tenter {

/// Relative standard deviation beyond which a knot or a combination of coefficients counts as not
/// seen.
inline constexpr double kSeenRelativeStd = 0.5;

/// Standard deviation of an entry of z (relative to its curve's mean stiffness) that stands for
/// "not known", and the variance from which an entry counts so.
inline constexpr double kVagueRelativeStd = 1000.0;
inline constexpr double kUnseenCoefficientVariance = 0.5 * kVagueRelativeStd * kVagueRelativeStd;

/// Information of one test about z, and how well it is met.
struct TestInformation {
  Eigen::VectorXd own;       ///< 1 for entries of z that are fitted to this test, 0 for others.
  Eigen::MatrixXd normal;    ///< Sum of J^T J.
  Eigen::VectorXd gradient;  ///< Sum of J^T r.
  /// Normal matrix and gradient of a part of its frames, consecutive ones.
  struct Run {
    Eigen::MatrixXd normal;
    Eigen::VectorXd gradient;
  };
  std::vector<Run> runs;

  /// Rows: what this test contributes to the equations that determine its own entries.
  Eigen::MatrixXd equations() const { return own.asDiagonal() * normal; }
  double chi2 = 0.0;
  double residuals = 0.0;  ///< Before compression.
  double chi2_per_dof =
      0.0;  ///< Degrees of freedom: residuals less what the parameters took up of them.
};

/// What the data say about z at the optimum (docs/fitting.md). Entries at their bound are held
/// there for the others; their own variance is that without the bound.
struct FitStatistics {
  std::vector<TestInformation> tests;
  std::vector<bool> at_bound;  ///< Of each entry of z.
  /// Of z as the fit determined it, from the data and its weak belief. Misfit beyond the noise
  /// widens it, test by test, and so does disagreement between runs of frames.
  Eigen::MatrixXd covariance;
  /// What the data alone would leave open: it tells what they see.
  Eigen::MatrixXd data_covariance;
};

/// Of the point that the evaluator evaluated last, with all its frames valid.
FitStatistics fitStatistics(const FrameEvaluator& evaluator, const std::vector<FitBlock>& blocks,
                            const Eigen::VectorXd& z);

/// Knot values of a group (in the first member's units), their standard deviations, and whether
/// they are seen.
struct KnotStatistics {
  Eigen::VectorXd value, std;
  std::vector<bool> observed;
};
/// @param covariance  of z, for the standard deviations.
/// @param data_covariance  of z, for what is seen.
KnotStatistics knotStatistics(const FitSpace& space, const Eigen::VectorXd& z,
                              const Eigen::MatrixXd& covariance,
                              const Eigen::MatrixXd& data_covariance, int group);

/// material.fit["identifiability"]: combinations of coefficients with their relative standard
/// deviation, seen or not.
nlohmann::json identifiabilityJson(const FitSpace& space, const FitStatistics& statistics);

/// material.fit["specimens"]: one linearised step a specimen from the common optimum, and the
/// scatter between them; null for one specimen.
nlohmann::json specimenJson(const FrameEvaluator& evaluator, const FitStatistics& statistics,
                            const Eigen::VectorXd& z);

}  // namespace tenter
