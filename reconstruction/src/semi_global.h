// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/reconstruction/camera_view.h"

namespace tenter {

/// A point of a surface as seen from one view.
struct SeenPoint {
  Vec3 position_m;
  Vec2 pixel;  ///< Of the first view.
};

/// Where a surface is known to lie: within `thickness_m` of a plane, to either side.
struct FlatPrior {
  Vec3 point_m, normal;
  double thickness_m;
};

/// Where a surface lies, to about a quarter of a pixel: the pair is rectified, seeds tell the plane
/// that lies nearest to it
/// unless `prior` knows one, and semi-global matching [Hir08] finds what departs from that plane.
/// One point for each `step_px` x `step_px` pixels of the first view in which the two agree.
/// Images are 8-bit. Error (without a file) if the two do not show a common surface.
Result<std::vector<SeenPoint>> semiGlobalPoints(const CameraView& a, const cv::Mat& image_a,
                                                const CameraView& b, const cv::Mat& image_b,
                                                int step_px, const FlatPrior* prior = nullptr);

}  // namespace tenter
