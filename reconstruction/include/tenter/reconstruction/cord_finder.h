// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "tenter/reconstruction/camera_view.h"
#include "tenter/reconstruction/gray_image.h"

namespace tenter {

/// Where a cord is thought to be.
struct CordGuess {
  Vec3 from_m = Vec3::Zero();  ///< Its end at the clip, in space.
  Vec3 to_m = Vec3::Zero();    ///< At the pulley.
  double diameter_m = 0.001;
};

/// A straight cord in space.
struct CordLine {
  Vec3 point_m = Vec3::Zero();     ///< On it, nearest to the middle of what was seen.
  Vec3 direction = Vec3::UnitX();  ///< Unit, from the clip to the pulley.
  double angle_sigma_rad = 0.0;    ///< Per transverse axis.
  double residual_px = 0.0;        ///< Of its centre line in the images, root mean square.
  int views = 0;
};

/// Finds a cord's centre line in each view, across many places along the guess, and one line in
/// space for all of them. Nothing if fewer than two views show enough of it, or if they lie so that
/// its direction is not determined. Cords must stand out, darker or brighter, from what is behind.
std::optional<CordLine> findCord(const std::vector<CameraView>& views,
                                 const std::vector<GrayImage>& images, const CordGuess& guess);

}  // namespace tenter
