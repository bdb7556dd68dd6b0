// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "tenter/inversion/contacts.h"
#include "tenter/inversion/inverse_shell.h"

namespace tenter {

/// Bounds that a certified rest shape meets (docs/inversion.md).
inline constexpr double kForceResidualBound = 1e-10;  ///< Of the total weight.
inline constexpr double kRoundingBound = 2.0;         ///< Or of what rounding of coordinates makes.
inline constexpr double kRedrapeBound = 1e-6;         ///< Of the target's size.
inline constexpr double kHeldContactForce = 1e-6;     ///< Of the weight: contacts that hold.
inline constexpr double kLambdaOverResidual = 100.0;  ///< lambda_min over its own residual.

/// What is known of a rest shape and its target pose. All of it comes from the forward problem on
/// the rest shape as it is written to files, never from the solver's own numbers.
struct Certificate {
  double force_residual_rel = 0.0;  ///< |F on free coordinates| / weight.
  /// The same of forces that the last bit of all coordinates makes: stiff and light cloth on a fine
  /// mesh has no rest shape in double precision that leaves less.
  double force_rounding_rel = 0.0;
  double weight_N = 0.0;
  std::vector<double> cone_margins;  ///< 1 - |r_T| / (mu r_N) of each contact; 1 without force.
  std::vector<bool> contact_holds;   ///< Contacts with a normal force above kHeldContactForce.
  int cone_violations = 0;           ///< Forces outside their cones.
  double cone_margin_min = 1.0;
  double lambda_min_per_s2 =
      0.0;  ///< Of H v = lambda M v, holding contacts and fixed vertices held.
  double lambda_residual_per_s2 = 0.0;
  int negative_eigenvalues = 0;     ///< Of H: its inertia.
  std::vector<double> redrape_rel;  ///< Distance to the target after each re-draping, of size.
  double redrape_max_rel = 0.0;
  Eigen::VectorXd stretch;   ///< (L_rest - L) / L of every edge.
  Eigen::VectorXd bend_rad;  ///< |theta_rest - theta| of every edge; 0 on the border.
  double size_m = 0.0;
  bool measured_stability = false;  ///< Whether lambda_min and the inertia were computed.
  bool complete = false;            ///< Every quantity was computed.

  bool balanced() const {
    return force_residual_rel <=
               std::max(kForceResidualBound, kRoundingBound * force_rounding_rel) &&
           cone_violations == 0;
  }
  bool stable() const {
    return measured_stability && negative_eigenvalues == 0 && lambda_min_per_s2 > 0.0 &&
           lambda_min_per_s2 >= kLambdaOverResidual * lambda_residual_per_s2;
  }
  bool holds() const {
    return complete && balanced() && stable() && redrape_max_rel <= kRedrapeBound;
  }
};

struct CertificateOptions {
  int redrapes = 20;
  double perturbation_rel = 1e-3;  ///< Displacement of every free vertex, of the target's size.
  unsigned seed = 20260103;
  std::function<bool()> stop;
};

/// @param rotations  edge rotations of the pose (InverseShell).
/// Error: a rest shape that the forward problem refuses.
Result<Certificate> certify(const InverseShell& shell, const Points3& pose, const Points3& rest,
                            const Eigen::VectorXd& rotations, const std::vector<int>& fixed,
                            const std::vector<Contact>& contacts,
                            const CertificateOptions& options);

}  // namespace tenter
