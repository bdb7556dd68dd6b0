// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "tenter/core/mesh.h"
#include "tenter/mechanics/element_rest.h"

namespace tenter {

inline constexpr const char* kMetricFile = "metric.json";

/// metric.json (docs/formats/inversion.md): rest length and rest angle of every edge of a mesh.
Result<void> writeElementRest(const std::filesystem::path& file, const MeshTopology& topology,
                              const ElementRest& rest);
/// Error: other edges than the mesh's, lengths far from those of the pose, angles beyond pi.
Result<ElementRest> readElementRest(const std::filesystem::path& file, const Points3& pose,
                                    const MeshTopology& topology);

}  // namespace tenter
