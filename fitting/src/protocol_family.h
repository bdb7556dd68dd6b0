// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>
#include <vector>

#include "tenter/core/measurement.h"
#include "tenter/mechanics/cloth_models.h"

namespace tenter {

/// Which clip forces a fit compares.
enum class ForceRows {
  kNone,
  kVector,      ///< All components.
  kAlongClips,  ///< Those along the clips' long sides.
};

/// One number that a force-displacement plot shows (captions of [Est12] Fig. 7), and its abscissa.
enum class Summary {
  kAxialForce,       ///< Half the difference of the two clips' forces along the line between them;
                     ///< abscissa: mean strain.
  kAggregateTorque,  ///< Torque about the centre of the cloth, every other clamp counted
                     ///< negatively; abscissa: effective shear [rad].
  kShearForce,       ///< Half the difference of two clips' forces along their long sides; abscissa:
                     ///< effective shear [rad].
  kPairDifference,   ///< Difference of the two corner-to-corner forces; abscissa: difference of the
                     ///< two stretches.
  kDrop,             ///< Mean descent of the tracked vertices [m]; abscissa: overhang [m].
};

/// What a protocol's measurement is compared by, [Est12] sec. 5.1.
struct ProtocolFamily {
  std::string_view prefix;  ///< Of the protocol's id.
  ForceRows forces;
  bool positions;
  Summary summary;
  std::vector<std::string_view>
      components;  ///< That the test can see, the one it isolates first; empty: all.
};

/// Protocols that are not listed compare all clip forces, or positions where no clip has a cord.
const ProtocolFamily& protocolFamily(const Measurement& measurement);

/// Indices of a family's components in a model, with those that a model's own couplings add.
std::vector<int> componentsSeen(const ProtocolFamily& family, const ClothModel& model);

}  // namespace tenter
