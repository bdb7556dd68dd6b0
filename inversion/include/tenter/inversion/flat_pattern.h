// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tenter/core/mesh.h"

namespace tenter {

struct FlatPatternOptions {
  /// Largest | flat length / length - 1 | of an edge that still counts as unrolled.
  double distortion = 0.01;
  int max_cuts = 16;  ///< Besides those that join the borders.
};

/// A surface unrolled into the plane.
struct FlatPattern {
  Points2 places;                    ///< 2 x corners of the pattern [m].
  std::vector<int> vertices;         ///< Of the surface, one a corner; cut vertices occur again.
  std::vector<Triangle> triangles;   ///< Of corners, in the surface's order.
  std::vector<int> outline;          ///< Corners around it, in order.
  std::vector<char> outline_is_cut;  ///< Whether a cut runs from each of these to the next.
  int cuts = 0;                      ///< Paths that were cut.
  double distortion = 0.0;           ///< Largest of an edge.
  Vec2 warp = Vec2::Zero();          ///< Mean direction of the warp in it; zero without uv.
};

/// Unrolls a surface in one piece. Tubes are cut along a shortest path between their borders; where
/// the result is too much distorted, from the vertex with the largest angle defect to the border,
/// again and again. Error kBadInput with the distortion that is left: it cannot be unrolled so;
/// also a surface without border or with handles, and a pattern that would overlap itself.
Result<FlatPattern> unroll(const TriangleMesh& surface, const FlatPatternOptions& options);

/// An SVG in millimetres at true scale, seen from the side on which triangles turn
/// counterclockwise: outline, seams that were cut (red, dashed), the warp as an arrow, a ruler of
/// 100 mm.
std::string patternSvg(const FlatPattern& pattern, const std::string& title);

}  // namespace tenter
