// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "tenter/core/types.h"

namespace tenter {

/// Disparities nearly everywhere within [least, most] of slope_x x + slope_y y + offset.
struct DisparityPlane {
  Vec3 plane;  ///< Slopes and offset [px].
  double least_px, most_px;
  int seeds;
};

/// Plane that most of a rectified pair lies near, from pieces of A that are searched for along
/// their rows of B, also stretched along them. `least` and `most` bound the disparities searched.
/// Nothing if too few pieces are found or they lie near no plane.
std::optional<DisparityPlane> findDisparityPlane(const cv::Mat& a, const cv::Mat& mask_a,
                                                 const cv::Mat& b, double least, double most);

}  // namespace tenter
