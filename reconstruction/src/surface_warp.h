// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "sheet_heights.h"

namespace tenter {

/// Matches once more with what the surface found so far does to the images taken out: each view is
/// seen as another one would see it if the surface were right, and what is left is so small and
/// smooth that affine subsets follow it. Their noise is half of that of quadratic ones, and
/// wrinkles no longer bias them (docs/reconstruction.md).
class SurfaceWarp {
 public:
  /// Holds references to all of them; they must outlive it.
  SurfaceWarp(const std::vector<CameraView>& views, const std::vector<GrayImage>& images,
              const SurfaceOptions& options, const SheetGrid& grid, const SheetHeights& heights);

  /// Refines valid vertices whose subsets lie on the grid; the others stay as they are.
  void refine(std::vector<RestVertex>& vertices) const;

 private:
  /// What matching once more makes of one sighting.
  struct Correction {
    bool good = false;
    Vec2 pixel = Vec2::Zero();
    Mat2 covariance_px2 = Mat2::Zero(), front_covariance_px2 = Mat2::Zero();
    double zncc = 0.0;
  };
  Correction correct(const RestVertex& vertex, int view, const SubsetMatcher& matcher,
                     const SplineImage& deformed, MatchScratch& scratch) const;
  /// By view; nothing happens unless all sightings but the front view's were corrected.
  void apply(const std::vector<std::pair<int, Correction>>& corrections, RestVertex& vertex) const;

  /// The surface where a pixel of a view sees it; nothing beside the grid.
  std::optional<Vec3> surfaceAt(const CameraView& view, const Vec2& pixel) const;
  double heightAt(const Vec2& place) const;
  bool onGrid(const Vec2& place) const;
  /// Image k as view f would see it.
  GrayImage seenFrom(int f, int k) const;
  bool subsetOnKnown(const RestVertex& vertex) const;

  const std::vector<CameraView>& views_;
  const std::vector<GrayImage>& images_;
  const SurfaceOptions& options_;
  const SheetGrid& grid_;
  const SheetHeights& heights_;
  Eigen::Isometry3d sheet_from_space_;
};

}  // namespace tenter
