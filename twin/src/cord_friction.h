// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

namespace tenter {

/// Friction of a cord on its pulley, as the cell behind the pulley reads it: more while the cord is
/// drawn in, less while it is let out. After a reversal it takes `kPresliding_m` of travel to turn
/// from one to the other.
class CordFriction {
 public:
  static constexpr double kPresliding_m = 1e-4;

  /// @param level_N  of fully developed friction.
  /// @param force_N  to begin with: -level_N after the cord was let out.
  explicit constexpr CordFriction(double level_N, double force_N = 0.0)
      : level_N_(level_N), force_N_(force_N) {}

  /// Free length between clip and pulley now; the first sets the beginning.
  void follow(double length_m) {
    if (length_m_ >= 0.0) {
      const double change_N = 2.0 * level_N_ * (length_m_ - length_m) / kPresliding_m;
      force_N_ = std::clamp(force_N_ + change_N, -level_N_, level_N_);
    }
    length_m_ = length_m;
  }
  double force_N() const { return force_N_; }

 private:
  double level_N_, force_N_;
  double length_m_ = -1.0;
};

}  // namespace tenter
