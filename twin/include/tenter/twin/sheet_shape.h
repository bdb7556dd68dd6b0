// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/mechanics/sheet_mesh.h"

namespace tenter {

/// The simulated sheet and what holds it at one moment: all that a camera's picture depends on.
struct SheetShape {
  GridLines lines;                         ///< Of the nodes, over the flat sample's x and y.
  std::vector<double> breaks_x, breaks_y;  ///< Lines across which the sheet may have a kink.
  Points3 nodes;                           ///< 3 x n [m], in the rig's frame.
  /// rig_from_clip in the order of the mounting; empty: the sample lies free of clips.
  std::vector<Eigen::Isometry3d> clips;
};

}  // namespace tenter
