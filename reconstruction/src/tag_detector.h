// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <set>
#include <string>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/core/types.h"
#include "tenter/reconstruction/gray_image.h"

namespace tenter {

/// A fiducial tag as an image shows it.
struct SeenTag {
  std::string family;
  int id = 0;
  /// Of the black border: upper left, upper right, lower right, lower left as printed [px].
  std::array<Vec2, 4> corners;
  double sigma_px = 0.0;  ///< Of a corner's coordinate, from how straight its sides are.
};

/// Tags of some families. Corners are where lines through the edges of the border meet, each edge
/// found where the image is steepest along many lines across it. A tag whose edges are not straight
/// and whole is left out. Error: an unknown family.
Result<std::vector<SeenTag>> findTags(const GrayImage& image,
                                      const std::set<std::string>& families);

}  // namespace tenter
