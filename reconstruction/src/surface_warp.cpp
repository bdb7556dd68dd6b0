// SPDX-License-Identifier: GPL-3.0-or-later
#include "surface_warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "parallel_for.h"

namespace tenter {

namespace {

constexpr int kIntersections = 8;
constexpr double kSmallStep_m = 1e-9;
/// Where the surface is not known, an image shows this part of white.
constexpr float kUnknownGrey = 0.5F;
/// A step of refinement larger than this was no refinement [px].
constexpr double kFarthest_px = 1.0;

/// Catmull-Rom weights of four nodes at the fraction t between the second and the third.
std::array<double, 4> cubicWeights(double t) {
  return {((-0.5 * t + 1.0) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1.0,
          ((-1.5 * t + 2.0) * t + 0.5) * t, (0.5 * t - 0.5) * t * t};
}

}  // namespace

SurfaceWarp::SurfaceWarp(const std::vector<CameraView>& views, const std::vector<GrayImage>& images,
                         const SurfaceOptions& options, const SheetGrid& grid,
                         const SheetHeights& heights)
    : views_(views),
      images_(images),
      options_(options),
      grid_(grid),
      heights_(heights),
      sheet_from_space_(grid.space_from_sheet.inverse()) {}

bool SurfaceWarp::onGrid(const Vec2& place) const {
  const Vec2 cell = (place - grid_.origin_m).cwiseQuotient(grid_.spacing_m);
  return cell.x() >= 0.0 && cell.y() >= 0.0 && cell.x() <= grid_.columns - 1 &&
         cell.y() <= grid_.rows - 1;
}

double SurfaceWarp::heightAt(const Vec2& place) const {
  const Vec2 cell = (place - grid_.origin_m).cwiseQuotient(grid_.spacing_m);
  const int column = std::clamp(static_cast<int>(cell.x()), 0, std::max(grid_.columns - 2, 0));
  const int row = std::clamp(static_cast<int>(cell.y()), 0, std::max(grid_.rows - 2, 0));
  const auto along = cubicWeights(cell.x() - column), across = cubicWeights(cell.y() - row);
  double sum = 0.0;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) {
      sum += along[i] * across[j] * heights_.extrapolated(column - 1 + i, row - 1 + j);
    }
  }
  return sum;
}

std::optional<Vec3> SurfaceWarp::surfaceAt(const CameraView& view, const Vec2& pixel) const {
  const auto ray = view.direction(pixel);
  if (!ray) return std::nullopt;
  const Vec3 from = sheet_from_space_ * view.centre();
  const Vec3 along = sheet_from_space_.linear() * *ray;
  if (!(std::abs(along.z()) > 0.0)) return std::nullopt;
  double height = 0.0;
  Vec2 place = Vec2::Zero();
  for (int i = 0; i < kIntersections; ++i) {
    place = (from + (height - from.z()) / along.z() * along).head<2>();
    if (!onGrid(place)) return std::nullopt;
    const double next = heightAt(place);
    const double step = next - height;
    height = next;
    if (std::abs(step) < kSmallStep_m) break;
  }
  return Vec3(grid_.space_from_sheet * Vec3(place.x(), place.y(), height));
}

GrayImage SurfaceWarp::seenFrom(int f, int k) const {
  const CameraView &from = views_[f], &to = views_[k];
  const SplineImage spline(images_[k]);
  GrayImage image(from.model.widthPx(), from.model.heightPx(), images_[k].white);
  std::fill(image.pixels.begin(), image.pixels.end(), kUnknownGrey * image.white);
  parallelFor(static_cast<std::size_t>(image.height), options_.correlate.threads,
              [&](std::size_t y, std::size_t) {
                for (int x = 0; x < image.width; ++x) {
                  const auto point = surfaceAt(from, Vec2(x, static_cast<double>(y)));
                  if (!point) continue;
                  const auto pixel = to.project(*point);
                  if (!pixel || pixel->x() < 0.0 || pixel->y() < 0.0 ||
                      pixel->x() > spline.width() - 1 || pixel->y() > spline.height() - 1) {
                    continue;
                  }
                  image.at(x, static_cast<int>(y)) = spline.value(pixel->x(), pixel->y());
                }
              });
  return image;
}

bool SurfaceWarp::subsetOnKnown(const RestVertex& vertex) const {
  const VertexSighting& own = vertex.sightings.front();
  const double r = options_.correlate.match.subset_px / 2;
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      const auto at = surfaceAt(views_[own.sighting.view], own.centre + r * Vec2(i, j));
      if (!at) return false;
      const Vec3 place = sheet_from_space_ * *at;
      if (!heights_.matched(heights_.nodeNear(place.head<2>()))) return false;
    }
  }
  return true;
}

SurfaceWarp::Correction SurfaceWarp::correct(const RestVertex& vertex, int view,
                                             const SubsetMatcher& matcher,
                                             const SplineImage& deformed,
                                             MatchScratch& scratch) const {
  Correction correction;
  const VertexSighting& base = vertex.sightings.front();
  const CameraView &front = views_[base.sighting.view], &other = views_[view];
  const SubsetMatch match =
      matcher.match(deformed, base.sighting.pixel, base.centre, SubsetWarp(), scratch);
  const Vec2 moved = match.warp.displacement();
  if (match.end != MatchEnd::kConverged || match.zncc < options_.correlate.min_zncc ||
      moved.norm() > kFarthest_px) {
    return correction;
  }
  const auto point = surfaceAt(front, base.sighting.pixel + moved);
  if (!point) return correction;
  // The match's error is in the front view's pixels; the surface says how they map.
  SurfaceElement element = heights_.elementAt((sheet_from_space_ * *point).head<2>());
  element.point_m = *point;
  const auto here = viewElement(front, element), there = viewElement(other, element);
  if (!here || !there) return correction;
  const Mat2 linear = there->pixel_from_tangents * here->pixel_from_tangents.inverse();
  correction.good = true;
  correction.pixel = there->pixel;
  correction.front_covariance_px2 = 0.5 * match.covariance_px2;
  correction.covariance_px2 = linear * correction.front_covariance_px2 * linear.transpose();
  correction.zncc = match.zncc;
  return correction;
}

void SurfaceWarp::apply(const std::vector<std::pair<int, Correction>>& corrections,
                        RestVertex& vertex) const {
  if (corrections.size() + 1 != vertex.sightings.size()) return;
  RestVertex refined = vertex;
  Mat2 own = Mat2::Zero();
  refined.zncc = 1.0;
  for (const auto& [view, correction] : corrections) {
    if (!correction.good) return;
    for (VertexSighting& s : refined.sightings) {
      if (s.sighting.view != view) continue;
      s.centre += correction.pixel - s.sighting.pixel;
      s.sighting.pixel = correction.pixel;
      s.sighting.covariance_px2 = correction.covariance_px2;
    }
    own += correction.front_covariance_px2 / static_cast<double>(corrections.size());
    refined.zncc = std::min(refined.zncc, correction.zncc);
  }
  refined.sightings.front().sighting.covariance_px2 = own;
  std::vector<Sighting> sightings;
  for (const VertexSighting& s : refined.sightings) sightings.push_back(s.sighting);
  const auto point = triangulate(views_, sightings, &vertex.point.position_m);
  if (!point || point->residual_px > options_.max_residual_px) return;
  refined.point = *point;
  refined.warped = true;
  vertex = std::move(refined);
}

void SurfaceWarp::refine(std::vector<RestVertex>& vertices) const {
  // Which vertices each pair of front view and other view has.
  std::map<std::pair<int, int>, std::vector<int>> tasks;
  for (int i = 0; i < static_cast<int>(vertices.size()); ++i) {
    if (vertices[i].state != PointState::kValid || !subsetOnKnown(vertices[i])) continue;
    const auto& sightings = vertices[i].sightings;
    for (std::size_t s = 1; s < sightings.size(); ++s) {
      tasks[{sightings.front().sighting.view, sightings[s].sighting.view}].push_back(i);
    }
  }
  MatchOptions affine = options_.correlate.match;
  affine.order = 1;
  const int threads = options_.correlate.threads;
  std::vector<MatchScratch> scratch(static_cast<std::size_t>(std::max(threads, 1)));
  std::vector<std::vector<std::pair<int, Correction>>> corrections(vertices.size());
  for (const auto& [pair, list] : tasks) {
    const auto [front, view] = pair;
    const GradientImage reference(images_[front]);
    const SubsetMatcher matcher(reference, affine);
    const SplineImage deformed(seenFrom(front, view));
    parallelFor(list.size(), threads, [&, other = view](std::size_t n, std::size_t worker) {
      const int i = list[n];
      corrections[i].emplace_back(other,
                                  correct(vertices[i], other, matcher, deformed, scratch[worker]));
    });
  }
  parallelFor(vertices.size(), threads,
              [&](std::size_t i, std::size_t) { apply(corrections[i], vertices[i]); });
}

}  // namespace tenter
