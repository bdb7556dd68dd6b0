// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "tenter/reconstruction/correlate.h"

namespace tenter {

/// Follows points of the first image of a sequence through the others. Each image is matched to
/// the first, never to the one before it, so errors do not add up; the one before it only says
/// where to look: optical flow carries the points on, their last shape is where the match begins.
/// Points that are lost are looked for again from their neighbours and from their last place.
class PointTracker {
 public:
  /// `centres` of the points' subsets where they are not the points themselves (SubsetMatcher);
  /// empty, or one a point. Error if the options cannot be used or a point lies outside the image.
  static Result<PointTracker> create(const GrayImage& reference, std::vector<Vec2> points,
                                     const CorrelateOptions& options,
                                     std::vector<Vec2> centres = {});
  PointTracker(PointTracker&&) noexcept;
  PointTracker& operator=(PointTracker&&) noexcept;
  ~PointTracker();

  /// The points in the next image, in their order; `match` is against the first image. Error if
  /// the image has another size or depth than the first; the tracker is then as before.
  Result<CorrelationField> track(const GrayImage& image);

  /// Goes on as if the last image tracked had been this one with the points moved so (one warp a
  /// point, around it). Precondition: the image has the size of the first.
  void goOnFrom(const GrayImage& image, std::vector<SubsetWarp> warps);

 private:
  struct State;
  explicit PointTracker(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tenter
