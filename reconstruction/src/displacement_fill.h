// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/core/mesh.h"
#include "tenter/reconstruction/cloth_tracker.h"

namespace tenter {

/// Gives vertices that were not seen the displacement that is smoothest between those that were:
/// their Laplacian over the mesh is zero.
class DisplacementFill {
 public:
  explicit DisplacementFill(const TriangleMesh& rest);

  /// Moves the vertices that are not valid; the others stay. Returns the farthest that one of them
  /// comes to lie from its place in `last` [m].
  double complete(ClothFrame& frame, const Points3& last) const;

 private:
  Points3 rest_;
  std::vector<std::vector<int>> neighbours_;
};

}  // namespace tenter
