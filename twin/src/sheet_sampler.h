// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/mechanics/sheet_mesh.h"

namespace tenter {

/// How positions between the nodes of a simulated grid are found.
enum class Sampling {
  kLinear,  ///< On the triangles, as a fit does.
  kCubic,   ///< Piecewise cubic along both axes, with breaks at the edges of clips and tables:
            ///< smooth as cloth.
};

/// Positions at fixed rest places of a grid sheet.
class SheetSampler {
 public:
  /// @param breaks_x, breaks_y  lines across which slopes may jump.
  SheetSampler(const GridLines& lines, const Points2& places, Sampling sampling,
               const std::vector<double>& breaks_x, const std::vector<double>& breaks_y);
  Points3 sample(const Eigen::Ref<const Points3>& nodes) const;

 private:
  struct Share {
    int node;
    double weight;
  };
  std::vector<std::vector<Share>> shares_;
};

}  // namespace tenter
