// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "height_field.h"
#include "semi_global.h"
#include "tenter/core/result.h"
#include "tenter/reconstruction/camera_view.h"
#include "tenter/reconstruction/gray_image.h"

namespace tenter {

/// Points of a surface from all pairs of views that are good for it: semi-global matching.
struct CoarseCloud {
  std::vector<Vec3> points_m;
  double pixel_m = 0.0;               ///< What a pixel covers at the surface, the median.
  std::vector<std::string> warnings;  ///< Pairs that showed nothing in common.
};

/// Error, with the last pair's reason, if no pair sees a surface. Views whose image is empty are
/// left out. `prior` (may be null): where the surface is known to lie.
Result<CoarseCloud> coarseCloud(const std::vector<CameraView>& views,
                                const std::vector<GrayImage>& images,
                                const std::function<bool()>& keep_going,
                                const FlatPrior* prior = nullptr);

/// Frame of the plane that a cloud lies nearest to: z towards the cameras, x as the columns of the
/// first view run, the origin in the cloud's middle. Robust against what lies elsewhere.
Eigen::Isometry3d planeOf(const CoarseCloud& cloud, const std::vector<CameraView>& views);

}  // namespace tenter
