// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>

#include "tenter/core/result.h"
#include "tenter/core/types.h"

// How ARCSim 0.2 and 0.3 evaluate their material files; written from the formulae of
// docs/formats/arcsim.md.
namespace tenter::arcsim {

inline constexpr int kStretchRows = 6, kStretchColumns = 4;
inline constexpr int kBendRows = 3, kBendColumns = 5;
inline constexpr double kTableStretch = 1.0 / 6.0;   ///< Principal stretch - 1 of rows 1 to 5.
inline constexpr double kCurvatureStep_per_m = 5.0;  ///< Of the program's own measure, kappa / 2.
inline constexpr double kRigidityPerEntry = 0.25;    ///< B = entry / 4 on aligned hinges.

using RowWeights = std::array<double, kStretchRows>;

struct Tables {
  double density_kg_per_m2 = 0.0;
  /// Rows of [c11 c12 c22 c33] [N/m]: row 0 at rest, rows 1-5 at stretch 1/6 along 0, 22.5 ... 90
  /// degrees from weft.
  Eigen::Matrix<double, kStretchRows, kStretchColumns> stretching;
  /// Edges along 0, 45, 90 degrees from weft; curvature measure 0, 5 ... 20 1/m. [N m]
  Eigen::Matrix<double, kBendRows, kBendColumns> bending;
};

/// From {"density", "stretching", "bending"}.
Result<Tables> tablesFromJson(const nlohmann::json& json, const std::string& file,
                              const std::string& place);
nlohmann::json tablesToJson(const Tables& tables);

/// Weights of the six rows in the program's stiffness at Green strain (E_uu, E_vv, 2 E_uv), its
/// doubling included: k = sum_r weight_r c_r, by way of the 30 x 30 x 30 grid that it tabulates.
RowWeights stretchWeights(const Vec3& green);
/// The same without the grid: straight from principal stretch and direction.
RowWeights stretchWeightsDirect(const Vec3& green);

/// Second Piola-Kirchhoff stress (S_uu, S_vv, S_uv) [N/m] at Green strain, negative stiffness taken
/// as zero as the program does.
Vec3 stress(const Tables& tables, const Vec3& green, bool direct = false);

/// Moment per width [N] of a cylinder of curvature kappa whose hinges lie at `edge_angle_rad` from
/// weft.
double cylinderMoment(const Tables& tables, double edge_angle_rad, double curvature_per_m);

}  // namespace tenter::arcsim
