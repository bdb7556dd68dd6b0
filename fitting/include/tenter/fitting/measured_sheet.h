// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "tenter/fitting/fit_test.h"

namespace tenter {

/// A measured moment of a cloth on a coarser mesh.
struct MeasuredSheet {
  TriangleMesh mesh;      ///< With material coordinates; positions in the rig's frame [m].
  std::vector<int> held;  ///< Vertices inside clips or on a table, at these bodies' poses.
  int unseen = 0;         ///< Of the others: those that no valid tracked vertex is near.
};

/// The shape of one frame: nodes inside clips at the clips' poses, the others by least squares
/// through the valid tracked vertices around them, with lines along the clips'
/// edges as a fit has them (docs/fitting-tests.md). Errors: the measurement tracks no cloth, has
/// fewer frames, or the frame shows no vertex.
Result<MeasuredSheet> measuredSheet(const Measurement& measurement, std::size_t frame,
                                    const FitTestOptions& options = {});

}  // namespace tenter
