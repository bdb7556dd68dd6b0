// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

#include "tenter/core/result.h"
#include "tenter/twin/specimen_law.h"

namespace tenter {

/// How far the protocols take a fabric: forces that a bench would set by hand.
struct FabricLimits {
  double stretch_weft_N = 10.0, stretch_warp_N = 10.0;  ///< Largest total force of a stretch test.
  double shear_N = 3.0;          ///< Largest pull on one clip of the picture frame.
  double complex_shear_N = 2.0;  ///< Largest pull along each bar.
  double corner_N = 2.0;         ///< Largest pull on one corner.
};

/// One virtual fabric: the truth that a fit does not know.
struct Fabric {
  std::string_view id;  ///< "satin-4": kind and the sample's number in [Est12] Table 1.
  std::string_view description;
  double areal_density_kg_per_m2 = 0.0;
  double thickness_m = 0.0;
  MembraneConstants membrane = {};
  BendingConstants bending = {};
  FrictionConstants friction = {};
  FabricLimits limits = {};
};

/// All fabrics. To add one: its row in fabrics.cpp.
std::span<const Fabric> fabrics();

/// Error names the fabrics there are.
Result<const Fabric*> findFabric(std::string_view id);

/// The fabric as one specimen has it: every law constant times 1 + 0.03 n, n standard normal cut
/// off at 2.5. The same number gives the same specimen on any machine. Number 0 is the nominal
/// fabric.
Fabric specimenOf(const Fabric& fabric, std::uint64_t specimen);

/// All constants by name, for truth files.
nlohmann::json fabricToJson(const Fabric& fabric);

}  // namespace tenter
