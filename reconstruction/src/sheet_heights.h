// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "height_field.h"
#include "view_matcher.h"

namespace tenter {

struct SubsetWeights;

/// Normal equations of a quadric through heights around a node: terms 1, x, y, x^2, x y, y^2.
struct QuadricEquations {
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  double squares = 0.0;  ///< Weighted, of the heights.
  int count = 0;
};

/// What each height counts in that of a quadric at the middle, all being known; 2 reach + 1 square.
Eigen::MatrixXd quadricWeights(int reach);

/// Heights of a surface at the nodes of a grid in its plane, as matches make them better.
class SheetHeights {
 public:
  SheetHeights(const SheetGrid& grid, const HeightField& coarse);

  /// Takes the matched vertices for what they are worth: those that contradict their neighbours
  /// become outliers, nodes without a match are filled from those around them.
  void refine(std::vector<RestVertex>& vertices, double pixel_m);

  /// With each height that of a quadric through those up to `reach` nodes away, which nearer ones
  /// pull at more.
  SheetHeights smoothed(int reach) const;
  /// With each height what an affine or a quadratic subset around it sees, of that order.
  SheetHeights seenBySubsets(const SubsetWeights& subset, int order) const;

  bool known(int node) const { return known_[static_cast<std::size_t>(node)] != 0; }
  /// Whether a match, and not what lies around it, says how high a node is.
  bool matched(int node) const { return matched_[static_cast<std::size_t>(node)] != 0; }
  /// The surface at a node, and at any place near one. Precondition: the (nearest) node is known.
  SurfaceElement element(int node) const { return elementAt(grid_.place(node)); }
  SurfaceElement elementAt(const Vec2& place_m) const;
  /// Height at the node of a column and row; beyond the border, as its outermost two go on.
  double extrapolated(int column, int row) const;
  int count() const { return static_cast<int>(heights_.size()); }
  double height(int node) const { return heights_[static_cast<std::size_t>(node)]; }
  void setHeight(int node, double height_m) { heights_[static_cast<std::size_t>(node)] = height_m; }
  /// Nearest node of a place.
  int nodeNear(const Vec2& place_m) const;

 private:
  std::vector<int> around(int node, int reach) const;
  Vec2 slope(int node) const;
  void dropOutliers(std::vector<RestVertex>& vertices, double pixel_m);
  void fill();
  QuadricEquations equationsAround(int node, int reach, double base) const;
  double quadricAt(int node, int reach) const;
  /// Where a plane or a quadric through the known nodes around leads; nothing if they are too few.
  std::optional<double> carriedTo(int node, int reach) const;

  const SheetGrid& grid_;
  std::vector<double> heights_;
  std::vector<std::uint8_t> known_, matched_;
};

}  // namespace tenter
