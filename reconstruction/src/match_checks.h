// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "tenter/reconstruction/correlate.h"

namespace tenter {

/// Where an image is at an end of its grey scale: at the format's own, or at a lower one at which
/// its camera stops.
class SaturationMap {
 public:
  explicit SaturationMap(const GrayImage& image);

  /// Share of the pixels of a square around a place, as far as it lies in the image.
  double share(const Vec2& place, int side_px) const;
  /// Share of the whole image.
  double share() const;

 private:
  int width_, height_;
  std::vector<int> sums_;  ///< Integral image, one row and column more than the image.
};

/// Why a point counts, from its match and from how much of it is saturated.
class MatchJudge {
 public:
  MatchJudge(const SaturationMap& reference, const SaturationMap& deformed,
             const CorrelateOptions& options)
      : reference_(reference), deformed_(deformed), options_(options) {}

  /// Whether there is a match at all, sure or not.
  bool matched(const SubsetMatch& match) const {
    return match.end == MatchEnd::kConverged && match.zncc >= options_.min_zncc;
  }
  PointState stateOf(const CorrelatedPoint& point) const;

 private:
  const SaturationMap &reference_, &deformed_;
  const CorrelateOptions& options_;
};

/// Mean square slope over variance [1/px^2]: falls when an image is defocused.
double sharpnessOf(const GrayImage& image);
/// The same, of what lies around some places. Precondition: they lie near the image.
double sharpnessAround(const GrayImage& image, const std::vector<Vec2>& places);

/// Whether a match agrees with its matched neighbours, each of which predicts the motion there.
/// False without two of them.
bool agreesWithNeighbours(const CorrelatedPoint& point,
                          const std::vector<const CorrelatedPoint*>& neighbours);

}  // namespace tenter
