// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/twin/capture.h"

namespace tenter {

/// What the virtual instruments do to a reading; tracking and forces as [Est12] sec. 3.3.
struct RigErrors {
  static constexpr double kVertex_m = 0.05e-3;            ///< Per axis.
  static constexpr double kClipPosition_m = 0.005e-3;     ///< Per axis.
  static constexpr double kClipRotation_rad = 8.7266e-5;  ///< 0.005 degrees, per axis.
  static constexpr double kCell_N = 3e-3;
  static constexpr double kCordFriction_N = 0.05;  ///< Half the hysteresis.
  static constexpr double kDirection_rad = 5e-4;   ///< Per transverse axis.
};

/// Standard deviations as the rig states them, with or without noise: a fit weighs by them.
void stateSigmas(Measurement& measurement);

/// Makes an exact frame one that instruments have read. Random numbers depend on seed, fabric,
/// protocol and frame alone.
void addNoise(const CaptureOptions& options, std::size_t index,
              const std::vector<double>& cord_motion, MeasurementFrame& frame);

}  // namespace tenter
