// SPDX-License-Identifier: GPL-3.0-or-later
#include "subset_centres.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "view_matcher.h"

namespace tenter {

namespace {

constexpr int kSteps = 10;
constexpr double kFarthest = 2.5;
/// What a clip may turn or lift against the cloth beside it [m].
constexpr double kClearance_m = 0.3e-3;
constexpr double kRounding_m = 1e-9;

struct Step {
  Vec2 offset;
  double distance;
};

/// Offsets of a lattice, nearest first.
const std::vector<Step>& lattice() {
  static const std::vector<Step> kLattice = [] {
    std::vector<Step> steps;
    for (int i = -kSteps; i <= kSteps; ++i) {
      for (int j = -kSteps; j <= kSteps; ++j) {
        const Vec2 offset = kFarthest / kSteps * Vec2(i, j);
        steps.push_back({offset, offset.norm()});
      }
    }
    std::stable_sort(steps.begin(), steps.end(),
                     [](const Step& a, const Step& b) { return a.distance < b.distance; });
    return steps;
  }();
  return kLattice;
}

/// Whether the way from a point to a camera leads through a box.
bool blocks(const ClipBox& box, const Vec3& point, const Vec3& camera) {
  double enter = 0.0, leave = 1.0;
  const Vec3 way = camera - point;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box.min_m[axis] - kClearance_m - point[axis];
    const double high = box.max_m[axis] + kClearance_m - point[axis];
    if (std::abs(way[axis]) < kRounding_m) {
      if (low > 0.0 || high < 0.0) return false;
      continue;
    }
    const double a = low / way[axis], b = high / way[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

/// Half a subset along x and y of the sheet's plane.
double halfSubset(const CameraView& view, const SurfaceElement& element, int subset_px) {
  const auto seen = viewElement(view, element);
  if (!seen) return 0.0;
  const Mat2 inverse = seen->pixel_from_tangents.inverse();
  return (subset_px / 2 + 1.0) * inverse.cwiseAbs().rowwise().sum().maxCoeff();
}

}  // namespace

bool holds(const std::vector<Vec2>& outline, const Vec2& place) {
  if (outline.size() < 3) return false;
  double turn = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 side = outline[(i + 1) % outline.size()] - outline[i], to = place - outline[i];
    const double cross = side.x() * to.y() - side.y() * to.x();
    if (std::abs(cross) <= kRounding_m * side.norm()) continue;
    if (turn * cross < 0.0) return false;
    turn = cross;
  }
  return true;
}

std::optional<Vec2> freeSquare(const Vec2& place, double half_m,
                               const std::function<bool(const Vec2&)>& free) {
  for (const Step& step : lattice()) {
    const Vec2 middle = place + half_m * step.offset;
    bool good = true;
    for (int i = -1; i <= 1 && good; ++i) {
      for (int j = -1; j <= 1 && good; ++j) good = free(middle + half_m * Vec2(i, j));
    }
    if (good) return middle;
  }
  return std::nullopt;
}

void avoidClips(const std::vector<CameraView>& views, const std::vector<MountedClip>& clips,
                int subset_px, const std::function<bool(const Vec2&)>& on_cloth,
                RestSurface& surface) {
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    RestVertex& vertex = surface.vertices[i];
    const Vec2 uv = surface.mesh.uv.col(static_cast<Eigen::Index>(i));
    const bool held = std::any_of(clips.begin(), clips.end(), [&](const MountedClip& clip) {
      return holds(clip.outline_uv_m, uv);
    });
    std::vector<VertexSighting> kept;
    for (VertexSighting s : vertex.sightings) {
      if (held) break;
      const CameraView& view = views[s.sighting.view];
      const Vec3& at = vertex.point.position_m;
      const SurfaceElement element{at, Eigen::Matrix<double, 3, 2>::Identity()};
      const Vec3 camera = view.centre();
      const auto free = [&](const Vec2& place) {
        if (!on_cloth(place)) return false;
        const Vec3 point(place.x(), place.y(), at.z());
        for (const MountedClip& clip : clips) {
          for (const ClipBox& body : clip.bodies) {
            if (blocks(body, point, camera)) return false;
          }
        }
        return true;
      };
      const auto middle = freeSquare(at.head<2>(), halfSubset(view, element, subset_px), free);
      if (!middle) continue;
      const auto seen = viewElement(view, element);
      const Vec2 before = s.centre;
      s.centre = s.sighting.pixel + seen->pixel_from_tangents * (*middle - at.head<2>());
      const Vec2 apart = (s.centre - before).cwiseAbs() / subset_px;
      s.shared = (Vec2::Ones() - apart).cwiseMax(0.0).prod();
      kept.push_back(s);
    }
    vertex.sightings = std::move(kept);
  }
}

}  // namespace tenter
