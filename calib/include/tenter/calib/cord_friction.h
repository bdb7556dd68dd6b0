// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <vector>

#include "tenter/calib/cord_calibration.h"

namespace tenter {

/// Friction within a pulley, as a share of the developed one: from -1 (let out) to 1 (drawn in).
class PulleyFriction {
 public:
  /// Precondition: presliding_m > 0.
  PulleyFriction(double presliding_m, double share) : presliding_m_(presliding_m), share_(share) {}
  /// `drawn_m`: cord that was drawn in over the pulley since.
  double follow(double drawn_m);
  double share() const { return share_; }

 private:
  double presliding_m_, share_;
};

/// Friction of a recorded cord [N], one value a sample, from what was measured alone: cord runs
/// over its pulley where its axis draws it in, and where the cord gives way because its end moves.
/// With the cord's stretch k the cord drawn in between two samples is
///   dm = dx - d(tension without friction) / k,
/// and the path of the friction is the one that explains all readings best (docs/rig-cords.md).
/// Without a stretch the axis' travel alone is gone by. Samples without a reading keep the friction
/// of the one before. Precondition: the cord's friction is known.
std::vector<double> frictionAlong(const CordEntry& cord, std::span<const double> positions_m,
                                  std::span<const double> tensions_N);

}  // namespace tenter
