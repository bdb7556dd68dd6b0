// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tenter/mechanics/cloth_models.h"
#include "tenter/mechanics/sheet_mesh.h"

namespace tenter {

/// A rectangular strip cut at an angle to the yarns, at rest in the plane z = 0 with x = u and y =
/// v, so the strip itself is turned.
struct StripSheet {
  SheetMesh sheet;
  Vec3 along = Vec3::UnitX();   ///< Unit vector of the strip's length, (cos angle, sin angle, 0).
  Vec3 across = Vec3::UnitY();  ///< Unit vector of its width.
  Eigen::VectorXd s;            ///< Place of every node along the strip [m].

  /// Nodes with begin - tolerance <= s <= end + tolerance.
  std::vector<int> nodesBetween(double begin, double end) const;
};

/// Lines along the strip (s) and across it. Springs run along the mesh lines, so models that need a
/// grid take 0 and 90 degrees only: error otherwise.
Result<StripSheet> makeStrip(const ClothModel& model, const std::vector<double>& lines_along,
                             const std::vector<double>& lines_across, double angle_rad,
                             DiagonalPattern diagonals);

/// `count` equal intervals of [begin, end], both ends included.
std::vector<double> equalLines(double begin, double end, int intervals);

}  // namespace tenter
