// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tenter/core/measurement.h"
#include "tenter/reconstruction/clip_tracker.h"
#include "tenter/reconstruction/cloth_tracker.h"
#include "tenter/reconstruction/reconstruct_session.h"

namespace tenter {

/// What holds the cloth and pulls it, frame by frame: clips, table, cords.
class RigReader {
 public:
  /// Holds references to all of them; they must outlive it.
  RigReader(const ImageSession& session, const RestSurface& rest, const TensionErrors& errors);

  /// Clips and their cords in the images of a moment. Error: tags of an unknown family.
  struct Reading {
    std::vector<ClipReading> clips;
    std::vector<CordReading> cords;
    std::vector<KnownVertex> held;  ///< Vertices that clips hold.
    std::vector<std::string> warnings;
    double clip_position_sigma_m = 0.0, clip_rotation_sigma_rad = 0.0;  ///< Largest of the clips.
  };
  Result<Reading> read(const std::vector<GrayImage>& images, const SessionMoment& moment);

  /// Adds the table, by where the cloth on it was seen to lie.
  void addTable(ClothFrame& cloth, Reading& reading) const;

  /// Whether cords are drawn in or let out between two moments; on a table, always loading.
  Branch branchBetween(const SessionMoment* before, const SessionMoment& now) const;

 private:
  Mat3 carriedCovariance(int vertex, const Vec3& at, const Mat3& turn) const;
  void hold(const MountedClip& clip, const ClipPose& pose, Reading& reading) const;
  void readCord(const MountedCord& cord, const std::vector<GrayImage>& images,
                const SessionMoment& moment, Reading& reading) const;

  const ImageSession& session_;
  const RestSurface& rest_;
  const TensionErrors errors_;
  std::vector<MountedClip> tagged_;  ///< Clips that have tags.
  ClipTracker tracker_;
  std::vector<Eigen::Isometry3d> last_;
  std::vector<std::vector<int>> held_;  ///< Vertices under each tagged clip.
};

}  // namespace tenter
