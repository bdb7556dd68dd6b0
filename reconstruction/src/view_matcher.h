// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "match_checks.h"
#include "seed_search.h"
#include "tenter/reconstruction/rest_surface.h"

namespace tenter {

/// A point of a surface with its tangent plane, both in space.
struct SurfaceElement {
  Vec3 point_m;
  Eigen::Matrix<double, 3, 2> tangents;  ///< Two directions along the surface, not unit.
};

/// d(pixel)/d(tangent coordinates) of a view at an element, and the pixel.
struct ViewedElement {
  Vec2 pixel;
  Mat2 pixel_from_tangents;
};
std::optional<ViewedElement> viewElement(const CameraView& view, const SurfaceElement& element);

/// Images of one moment, prepared for matching subsets between them.
class ViewMatcher {
 public:
  ViewMatcher(const std::vector<CameraView>& views, const std::vector<GrayImage>& images,
              const SurfaceOptions& options);
  ViewMatcher(const ViewMatcher&) = delete;
  ViewMatcher& operator=(const ViewMatcher&) = delete;

  /// Finds a vertex in all views that show it: its subset in the view that sees it most from the
  /// front is looked for in the others, where the element says. `centre` is the element in the
  /// middle of the subset, often the same.
  RestVertex match(const SurfaceElement& element, const SurfaceElement& centre,
                   MatchScratch& scratch) const;

  /// Half a subset at an element, along the surface [m]; the largest of all views that see it.
  double halfSubset_m(const SurfaceElement& element) const;
  /// Where the texture around an element occurs again in the view that sees it best.
  std::optional<SeedSearch::Repeat> repeatOf(const SurfaceElement& element) const;

 private:
  struct View {
    GradientImage reference;
    SplineImage spline;
    SaturationMap ends;
    std::unique_ptr<SubsetMatcher> matcher;
    View(const GrayImage& image, const MatchOptions& options)
        : reference(image),
          spline(image),
          ends(image),
          matcher(std::make_unique<SubsetMatcher>(reference, options)) {}
  };

  /// A subset of the front view: the vertex as seen there, and the subset's middle.
  struct Subset {
    ViewedElement seen;
    Vec2 middle;
  };
  /// What a second view makes of it.
  struct Found {
    PointState state = PointState::kOutside;
    VertexSighting sighting;
    Mat2 front_covariance_px2 = Mat2::Zero();  ///< Of the front view's own sighting.
    double zncc = 0.0;
  };
  Found findIn(int k, int front, const Subset& subset, const SurfaceElement& element,
               const SurfaceElement& centre, MatchScratch& scratch) const;
  void settle(const Vec3& guess, RestVertex& vertex) const;
  /// View whose subset around the element is inside and seen most from the front, or -1.
  int frontView(const SurfaceElement& element) const;
  bool subsetInside(int view, const Vec2& pixel) const;

  const std::vector<CameraView>& views_;
  const SurfaceOptions& options_;
  std::vector<std::unique_ptr<View>> prepared_;  ///< Null where there is no image.
};

}  // namespace tenter
