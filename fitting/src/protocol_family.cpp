// SPDX-License-Identifier: GPL-3.0-or-later
#include "protocol_family.h"

#include <algorithm>

namespace tenter {
namespace {

const std::vector<ProtocolFamily>& families() {
  static const std::vector<ProtocolFamily> kFamilies = {
      {"stretch-weft",
       ForceRows::kVector,
       false,
       Summary::kAxialForce,
       {"stretch_weft", "poisson"}},
      {"stretch-warp",
       ForceRows::kVector,
       false,
       Summary::kAxialForce,
       {"stretch_warp", "poisson"}},
      {"shear",
       ForceRows::kAlongClips,
       false,
       Summary::kAggregateTorque,
       {"shear", "cross_stiffening"}},
      {"bend-weft", ForceRows::kNone, true, Summary::kDrop, {"bend_weft", "bend_diagonal"}},
      {"bend-warp", ForceRows::kNone, true, Summary::kDrop, {"bend_warp", "bend_diagonal"}},
      {"bend-bias",
       ForceRows::kNone,
       true,
       Summary::kDrop,
       {"bend_diagonal", "bend_weft", "bend_warp"}},
      {"complex-shear", ForceRows::kVector, false, Summary::kShearForce, {}},
      {"corner-pull", ForceRows::kVector, false, Summary::kPairDifference, {}},
  };
  return kFamilies;
}

const ProtocolFamily kOtherPull{"", ForceRows::kVector, false, Summary::kAxialForce, {}};
const ProtocolFamily kOtherShape{"", ForceRows::kNone, true, Summary::kDrop, {}};

}  // namespace

const ProtocolFamily& protocolFamily(const Measurement& m) {
  for (const ProtocolFamily& family : families())
    if (m.protocol.starts_with(family.prefix)) return family;
  const bool pulled = std::any_of(m.frames.begin(), m.frames.end(),
                                  [](const MeasurementFrame& f) { return !f.cords.empty(); });
  return pulled ? kOtherPull : kOtherShape;
}

std::vector<int> componentsSeen(const ProtocolFamily& family, const ClothModel& model) {
  std::vector<int> seen;
  const auto see = [&](std::string_view name) {
    const int index = model.componentIndex(name);
    if (index >= 0 && std::find(seen.begin(), seen.end(), index) == seen.end())
      seen.push_back(index);
  };
  for (const std::string_view name : family.components) see(name);
  if (model.bending == BendingElement::kSprings && family.forces != ForceRows::kNone) {
    // Diagonal springs lengthen when the cloth is stretched along a yarn, and springs to the second
    // neighbour stand beside all others.
    for (const std::string_view name : {"shear", "bend_diagonal"}) see(name);
    if (family.prefix == "stretch-weft") see("bend_weft");
    if (family.prefix == "stretch-warp") see("bend_warp");
  }
  if (family.components.empty())
    for (int i = 0; i < model.componentCount(); ++i) seen.push_back(i);
  return seen;
}

}  // namespace tenter
