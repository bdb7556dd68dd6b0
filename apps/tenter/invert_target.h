// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "command.h"
#include "tenter/core/mesh.h"

namespace tenter::app {

/// How a measurement becomes a target.
struct MeasuredTargetOptions {
  std::optional<int> frame;  ///< From 0; else the last.
  int nodes = 25;            ///< Per side.
};

/// A shape to hang in, and what is known of it.
struct InvertTarget {
  TriangleMesh mesh;
  std::vector<int> held;  ///< Of a measurement: inside clips and on its table; sorted.
  Vec3 gravity_m_per_s2 = kDefaultGravity;
};

/// A mesh file, or a frame of a measurement's folder. Warns of what a frame does not show. Usage
/// error: a frame of a file that is no measurement.
Result<InvertTarget> readTarget(const std::string& path, const MeasuredTargetOptions& options,
                                const Console& console);

}  // namespace tenter::app
