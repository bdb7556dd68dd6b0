// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tenter/reconstruction/point_tracker.h"
#include "tenter/reconstruction/rest_surface.h"

namespace tenter {

/// The cloth at one moment, vertex by vertex of the mesh at rest.
struct ClothFrame {
  Points3 positions_m;                ///< 3 x n; finite for all vertices.
  std::vector<Mat3> covariances_m2;   ///< n; of filled vertices a guess.
  std::vector<PointState> states;     ///< n; what is not valid was filled from its neighbours.
  std::vector<std::uint8_t> views;    ///< n; how many views showed it.
  std::vector<float> zncc;            ///< n; least over its views.
  std::vector<float> residual_px;     ///< n.
  double filled_m = 0.0;              ///< Largest distance of a filled vertex from its last place.
  std::vector<std::string> warnings;  ///< About views, by name.

  std::size_t validCount() const;
};

/// A vertex whose place is known otherwise: a clip holds it.
struct KnownVertex {
  int vertex = 0;
  Vec3 position_m = Vec3::Zero();
  Mat3 covariance_m2 = Mat3::Zero();
};

/// The frame at rest in the same form.
ClothFrame restFrame(const RestSurface& surface);

/// Follows the vertices of a surface through images of later moments. Each view's subsets are
/// matched to that view's image at rest; the sightings of a vertex are triangulated together.
class ClothTracker {
 public:
  /// Holds copies of what it needs. Error: options that cannot be used.
  static Result<ClothTracker> create(const std::vector<CameraView>& views,
                                     const std::vector<GrayImage>& images,
                                     const RestSurface& surface, const SurfaceOptions& options);
  ClothTracker(ClothTracker&&) noexcept;
  ClothTracker& operator=(ClothTracker&&) noexcept;
  ~ClothTracker();

  /// The cloth in the next images, one a view; an empty one is missing. Known vertices are valid
  /// and lie where they are said to. Error, with the view's name as place: an image of another size
  /// or depth.
  Result<ClothFrame> track(const std::vector<GrayImage>& images,
                           const std::vector<KnownVertex>& known = {});

  /// Goes on after a frame that was found before; `images` are those it was found in. What follows
  /// is what it would have been, to the tolerance of a match.
  void goOnFrom(const ClothFrame& frame, const std::vector<GrayImage>& images);

 private:
  struct State;
  explicit ClothTracker(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace tenter
