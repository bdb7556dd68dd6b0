// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/cloth_tracker.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "carried_warp.h"
#include "displacement_fill.h"
#include "parallel_for.h"
#include "tracked_covariance.h"

namespace tenter {

namespace {

/// A sighting contradicts the others where its residual grows, against that at rest, by more than a
/// fixed part [px] and so many sigmas.
constexpr double kGrowth_px = 0.15, kGrowthSigmas = 5.0;

/// The vertices that one view follows.
struct TrackedView {
  std::vector<int> vertices;
  std::vector<std::size_t> places;  ///< Of the sighting in each vertex's list.
  std::optional<PointTracker> tracker;
};

/// The surface at rest with the covariances of its matches alone.
ClothFrame matchedFrame(const RestSurface& surface) {
  ClothFrame frame;
  frame.positions_m = surface.mesh.positions;
  for (const RestVertex& vertex : surface.vertices) {
    const bool valid = vertex.state == PointState::kValid;
    // A filled vertex may err by several pixels.
    constexpr double kFilledError_px = 5.0;
    const double guess = kFilledError_px * surface.pixel_m;
    frame.covariances_m2.push_back(valid ? vertex.point.covariance_m2
                                         : Mat3(guess * guess * Mat3::Identity()));
    frame.states.push_back(vertex.state);
    frame.views.push_back(static_cast<std::uint8_t>(valid ? vertex.sightings.size() : 0));
    frame.zncc.push_back(static_cast<float>(vertex.zncc));
    frame.residual_px.push_back(static_cast<float>(valid ? vertex.point.residual_px : 0.0));
  }
  return frame;
}

}  // namespace

struct ClothTracker::State {
  std::vector<CameraView> views;
  RestSurface surface;
  SurfaceOptions options;
  std::vector<TrackedView> tracked;
  std::vector<std::vector<Vec2>> rest_residuals;  ///< Of each sighting of each vertex [px].
  Points3 last;
  DisplacementFill fill;
  CarriedWarp carried;

  State(const std::vector<CameraView>& seen_by, const RestSurface& rest,
        const SurfaceOptions& wanted)
      : views(seen_by),
        surface(rest),
        options(wanted),
        last(rest.mesh.positions),
        fill(rest.mesh),
        carried(rest.mesh) {}

  Result<void> prepare(const std::vector<GrayImage>& images);
  Result<void> follow(std::size_t v, const GrayImage& image, std::vector<TrackedSightings>& seen,
                      ClothFrame& frame);
  void locate(int vertex, TrackedSightings& seen, ClothFrame& frame) const;
  Mat3 covarianceOf(int vertex, const TrackedSightings& seen, const Points3& positions_m) const;
};

Result<void> ClothTracker::State::prepare(const std::vector<GrayImage>& images) {
  tracked.resize(views.size());
  rest_residuals.resize(surface.vertices.size());
  for (int i = 0; i < static_cast<int>(surface.vertices.size()); ++i) {
    const RestVertex& vertex = surface.vertices[i];
    if (vertex.state != PointState::kValid) continue;
    for (std::size_t k = 0; k < vertex.sightings.size(); ++k) {
      const Sighting& sighting = vertex.sightings[k].sighting;
      const auto projected = views[sighting.view].project(vertex.point.position_m);
      rest_residuals[i].push_back(projected ? Vec2(sighting.pixel - *projected) : Vec2::Zero());
      // A subset that was moved inwards may see a vertex that lies just beyond the image.
      const CameraModel& camera = views[sighting.view].model;
      const Vec2 corner(camera.widthPx() - 1, camera.heightPx() - 1);
      if ((sighting.pixel.array() < 0.0).any() || (sighting.pixel.array() > corner.array()).any()) {
        continue;
      }
      tracked[sighting.view].vertices.push_back(i);
      tracked[sighting.view].places.push_back(k);
    }
  }
  for (std::size_t v = 0; v < views.size(); ++v) {
    TrackedView& view = tracked[v];
    if (view.vertices.empty()) continue;
    std::vector<Vec2> points, centres;
    for (std::size_t i = 0; i < view.vertices.size(); ++i) {
      const VertexSighting& s = surface.vertices[view.vertices[i]].sightings[view.places[i]];
      points.push_back(s.sighting.pixel);
      centres.push_back(s.centre);
    }
    auto tracker =
        PointTracker::create(images[v], std::move(points), options.correlate, std::move(centres));
    if (!tracker) return tracker.error();
    view.tracker.emplace(std::move(*tracker));
  }
  return {};
}

/// Finds a view's subsets in its next image and adds what it shows to the vertices' sightings.
Result<void> ClothTracker::State::follow(std::size_t v, const GrayImage& image,
                                         std::vector<TrackedSightings>& seen, ClothFrame& frame) {
  TrackedView& view = tracked[v];
  const auto field = view.tracker->track(image);
  if (!field) {
    Error error = field.error();
    error.place = views[v].name;
    return error;
  }
  for (const std::string& warning : field->warnings) {
    frame.warnings.push_back(views[v].name + ": " + warning);
  }
  for (std::size_t i = 0; i < view.vertices.size(); ++i) {
    const CorrelatedPoint& point = field->points[i];
    const int vertex = view.vertices[i];
    if (!point.valid()) {
      if (seen[vertex].now.empty()) frame.states[vertex] = point.state;
      continue;
    }
    const SubsetWarp& warp = point.match.warp;
    seen[vertex].now.push_back(
        {static_cast<int>(v), point.position + warp.displacement(), point.match.covariance_px2});
    seen[vertex].places.push_back(view.places[i]);
    seen[vertex].now_from_rest_px.push_back(warp.linear());
    frame.zncc[vertex] = std::min(frame.zncc[vertex], static_cast<float>(point.match.zncc));
  }
  return {};
}

/// Triangulates a vertex from where its views show it; drops what contradicts the others.
void ClothTracker::State::locate(int vertex, TrackedSightings& seen, ClothFrame& frame) const {
  const Vec3 guess = last.col(vertex);
  while (seen.now.size() >= 2) {
    const auto point = triangulate(views, seen.now, &guess);
    if (!point) {
      frame.states[vertex] = PointState::kNotFound;
      return;
    }
    std::size_t worst = seen.now.size();
    double worst_excess = 0.0;
    for (std::size_t k = 0; k < seen.now.size(); ++k) {
      const auto projected = views[seen.now[k].view].project(point->position_m);
      if (!projected) continue;
      const Vec2 grown = seen.now[k].pixel - *projected - rest_residuals[vertex][seen.places[k]];
      const double allowed =
          kGrowth_px + kGrowthSigmas * std::sqrt(seen.now[k].covariance_px2.trace());
      const double excess = grown.norm() / allowed;
      if (excess > 1.0 && excess > worst_excess) {
        worst = k;
        worst_excess = excess;
      }
    }
    if (worst == seen.now.size()) {
      frame.positions_m.col(vertex) = point->position_m;
      frame.residual_px[vertex] = static_cast<float>(point->residual_px);
      frame.views[vertex] = static_cast<std::uint8_t>(seen.now.size());
      frame.states[vertex] = PointState::kValid;
      return;
    }
    frame.states[vertex] = PointState::kOutlier;
    if (seen.now.size() == 2) return;
    seen.drop(worst);
  }
}

Mat3 ClothTracker::State::covarianceOf(int vertex, const TrackedSightings& seen,
                                       const Points3& positions_m) const {
  const Mat3 gradient = carried.gradient(vertex, positions_m);
  const Vec3 at = positions_m.col(vertex);
  return trackedCovariance(views, surface, vertex, at, seen, gradient) +
         surface.systematicAt(vertex, at, seen.now, gradient);
}

ClothTracker::ClothTracker(std::unique_ptr<State> state) : state_(std::move(state)) {}
ClothTracker::ClothTracker(ClothTracker&&) noexcept = default;
ClothTracker& ClothTracker::operator=(ClothTracker&&) noexcept = default;
ClothTracker::~ClothTracker() = default;

Result<ClothTracker> ClothTracker::create(const std::vector<CameraView>& views,
                                          const std::vector<GrayImage>& images,
                                          const RestSurface& surface,
                                          const SurfaceOptions& options) {
  auto state = std::make_unique<State>(views, surface, options);
  if (auto ready = state->prepare(images); !ready) return ready.error();
  return ClothTracker(std::move(state));
}

Result<ClothFrame> ClothTracker::track(const std::vector<GrayImage>& images,
                                       const std::vector<KnownVertex>& known) {
  State& s = *state_;
  const std::size_t count = s.surface.vertices.size();
  std::vector<TrackedSightings> seen(count);
  ClothFrame frame = matchedFrame(s.surface);
  for (std::size_t i = 0; i < count; ++i) {
    frame.zncc[i] = 1.0F;
    frame.views[i] = 0;
    if (frame.states[i] == PointState::kValid) frame.states[i] = PointState::kNotFound;
  }
  for (std::size_t v = 0; v < s.views.size(); ++v) {
    if (!s.tracked[v].tracker || images[v].width == 0) continue;
    auto followed = s.follow(v, images[v], seen, frame);
    if (!followed) return followed.error();
  }
  parallelFor(count, s.options.correlate.threads,
              [&](std::size_t i, std::size_t) { s.locate(static_cast<int>(i), seen[i], frame); });
  std::vector<std::uint8_t> found(count);
  for (std::size_t i = 0; i < count; ++i) found[i] = frame.states[i] == PointState::kValid;
  for (const KnownVertex& vertex : known) {
    found[vertex.vertex] = 0;
    frame.positions_m.col(vertex.vertex) = vertex.position_m;
    frame.covariances_m2[vertex.vertex] = vertex.covariance_m2;
    frame.states[vertex.vertex] = PointState::kValid;
  }
  frame.filled_m = s.fill.complete(frame, s.last);
  parallelFor(count, s.options.correlate.threads, [&](std::size_t i, std::size_t) {
    if (found[i] != 0)
      frame.covariances_m2[i] = s.covarianceOf(static_cast<int>(i), seen[i], frame.positions_m);
  });
  s.last = frame.positions_m;
  return frame;
}

void ClothTracker::goOnFrom(const ClothFrame& frame, const std::vector<GrayImage>& images) {
  State& s = *state_;
  s.last = frame.positions_m;
  for (std::size_t v = 0; v < s.views.size(); ++v) {
    TrackedView& view = s.tracked[v];
    if (!view.tracker || images[v].width == 0) continue;
    std::vector<SubsetWarp> warps;
    for (const int vertex : view.vertices) {
      warps.push_back(s.carried.of(vertex, frame.positions_m, s.views[v]));
    }
    view.tracker->goOnFrom(images[v], std::move(warps));
  }
}

std::size_t ClothFrame::validCount() const {
  return static_cast<std::size_t>(std::count(states.begin(), states.end(), PointState::kValid));
}

ClothFrame restFrame(const RestSurface& surface) {
  ClothFrame frame = matchedFrame(surface);
  const CarriedWarp carried(surface.mesh);
  for (int i = 0; i < static_cast<int>(surface.vertices.size()); ++i) {
    if (surface.vertices[i].state != PointState::kValid) continue;
    // Along the surface a vertex is where its node is.
    const Mat3 along = carried.gradient(i, surface.mesh.positions);
    const Mat3 across = Mat3::Identity() - along;
    frame.covariances_m2[i] =
        across * frame.covariances_m2[i] * across.transpose() +
        surface.systematicAt(i, surface.mesh.positions.col(i), surface.sightingsOf(i), along);
  }
  return frame;
}

}  // namespace tenter
