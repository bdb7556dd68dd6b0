// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "tenter/core/types.h"

namespace tenter {

/// Heights over a plane in square cells, for first guesses of a surface.
class HeightField {
 public:
  /// Median height of the points of each cell; cells that disagree with those around them are left
  /// out, small holes are closed, and the rest is smoothed lightly.
  /// @param points  Place (x, y) and height z [m].
  HeightField(const std::vector<Vec3>& points, double cell_m);

  /// Height [m] at a place, and its slopes; nothing where the surface is not known.
  struct Tangent {
    double height_m;
    Vec2 slope;
  };
  std::optional<Tangent> at(const Vec2& place_m) const;
  bool knows(const Vec2& place_m) const;

  Vec2 least() const { return origin_; }
  Vec2 most() const { return origin_ + cell_m_ * Vec2(columns_, rows_); }
  double cell_m() const { return cell_m_; }
  /// Forgets all but the largest connected piece.
  void keepLargest();

 private:
  int index(int column, int row) const { return row * columns_ + column; }
  bool knownCell(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns_ && row < rows_ &&
           known_[static_cast<std::size_t>(index(column, row))] != 0;
  }
  std::vector<double> knownAround(int column, int row, int reach) const;
  void dropOutliers();
  void closeHoles();
  void smooth();

  Vec2 origin_;
  double cell_m_;
  int columns_ = 0, rows_ = 0;
  std::vector<double> heights_;
  std::vector<std::uint8_t> known_;
};

}  // namespace tenter
