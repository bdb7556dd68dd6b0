// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "tenter/core/types.h"

namespace tenter {

/// How a small piece of the reference image moved. At the offset (a, b) [px] from its point:
///   u(a, b) = u + u_x a + u_y b + u_xx a^2 / 2 + u_xy a b + u_yy b^2 / 2   [px], the same for v.
/// The point (x, y) of the reference lies at (x + u, y + v) in the deformed image.
struct SubsetWarp {
  using Polynomial = std::array<double, 6>;  ///< Value, x, y, xx, xy, yy.

  Polynomial u{}, v{};

  static SubsetWarp translation(const Vec2& displacement_px);
  /// x -> linear * x + displacement around the point.
  static SubsetWarp affine(const Vec2& displacement_px, const Mat2& linear);

  Vec2 displacement() const { return {u[0], v[0]}; }
  Vec2 displacementAt(const Vec2& offset_px) const;
  /// I + grad (u, v) at the point.
  Mat2 linear() const;
  /// The same motion, written around the point + offset.
  SubsetWarp movedBy(const Vec2& offset_px) const;
};

}  // namespace tenter
