// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "protocol_family.h"
#include "tenter/mechanics/cloth_system.h"

namespace tenter {

/// A protocol's force summary as a linear function of the clips' stacked forces and torques, and
/// its abscissa.
struct ForceSummary {
  Eigen::VectorXd weights;  ///< As ClipForces::measured.
  double abscissa = 0.0;
};

/// @param clips  indices of the clips that have cords.
ForceSummary forceSummary(Summary kind, const SheetMesh& sheet, const SystemSetup& setup,
                          const ClothState& state, const std::vector<int>& clips);

/// Unit vector of a clip's long side, at its pose in `state`; zero if it holds a single node.
Vec3 longSide(const SheetMesh& sheet, const ClipSetup& clip, const Eigen::Isometry3d& pose);

}  // namespace tenter
