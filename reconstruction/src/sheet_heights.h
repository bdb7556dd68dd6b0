// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "height_field.h"
#include "view_matcher.h"

namespace tenter {

/// Heights of a surface at the nodes of a grid in its plane, as matches make them better.
class SheetHeights {
 public:
  SheetHeights(const SheetGrid& grid, const HeightField& coarse);

  /// Takes the matched vertices for what they are worth: those that contradict their neighbours
  /// become outliers, nodes without a match are filled from those around them.
  void refine(std::vector<RestVertex>& vertices, double pixel_m);

  /// With each height that of a quadric through those around it, up to `reach_m` away, which nearer
  /// ones pull at more.
  SheetHeights smoothed(double reach_m) const;

  bool known(int node) const { return known_[static_cast<std::size_t>(node)] != 0; }
  /// Whether a match, and not what lies around it, says how high a node is.
  bool matched(int node) const { return matched_[static_cast<std::size_t>(node)] != 0; }
  /// The surface at a node, and at any place near one. Precondition: the (nearest) node is known.
  SurfaceElement element(int node) const { return elementAt(grid_.place(node)); }
  SurfaceElement elementAt(const Vec2& place_m) const;
  /// Height at the node of a column and row; beyond the border, as its outermost two go on.
  double extrapolated(int column, int row) const;
  /// Nearest node of a place.
  int nodeNear(const Vec2& place_m) const;

 private:
  std::vector<int> around(int node, int reach) const;
  Vec2 slope(int node) const;
  void dropOutliers(std::vector<RestVertex>& vertices, double pixel_m);
  void fill();
  double quadricAt(int node, const Eigen::Vector2i& reach) const;

  const SheetGrid& grid_;
  std::vector<double> heights_;
  std::vector<std::uint8_t> known_, matched_;
};

}  // namespace tenter
