// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tenter/reconstruction/camera_view.h"
#include "tenter/reconstruction/gray_image.h"
#include "tenter/session/mounting.h"

namespace tenter {

/// Where a clip is.
struct ClipPose {
  Eigen::Isometry3d rig_from_clip = Eigen::Isometry3d::Identity();
  /// Standard deviations per axis, of the middle of its tags and of its turn.
  double position_sigma_m = 0.0, rotation_sigma_rad = 0.0;
  double residual_px = 0.0;  ///< Root mean square distance of corners from their projections.
  int tags = 0, views = 0;   ///< Tags seen, counted once a view; views that see any.
};

/// Finds clips by their tags, all views jointly.
class ClipTracker {
 public:
  ClipTracker(std::vector<CameraView> views, std::vector<MountedClip> clips);

  /// Pose of each clip in the rig's frame; nothing for one whose tags fewer than two views show, or
  /// whose tags contradict each other. `last` are the poses to begin from. Error: a tag's family is
  /// not known.
  Result<std::vector<std::optional<ClipPose>>> find(
      const std::vector<GrayImage>& images, const std::vector<Eigen::Isometry3d>& last) const;

 private:
  struct Corner {
    int view;
    Vec3 point_m;  ///< In the clip's frame.
    Vec2 pixel;
    double sigma_px;
    int tag;
  };
  std::optional<ClipPose> fit(std::vector<Corner> corners, const Eigen::Isometry3d& start) const;

  std::vector<CameraView> views_;
  std::vector<MountedClip> clips_;
  std::set<std::string> families_;
};

}  // namespace tenter
