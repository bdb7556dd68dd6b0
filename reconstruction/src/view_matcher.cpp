// SPDX-License-Identifier: GPL-3.0-or-later
#include "view_matcher.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace tenter {

namespace {

/// A view counts as seeing an element from the front down to this cosine.
constexpr double kLeastCosine = 0.17;
/// Sightings that disagree by more than this many of their sigmas, and by more than the fixed part
/// of the largest allowed residual, are dropped while more than two are left.
constexpr double kLargestChi = 5.0;
constexpr double kFixedShare = 0.5;

Vec3 normalOf(const SurfaceElement& element) {
  return element.tangents.col(0).cross(element.tangents.col(1)).normalized();
}

}  // namespace

std::optional<ViewedElement> viewElement(const CameraView& view, const SurfaceElement& element) {
  Eigen::Matrix<double, 2, 3> jacobian;
  const auto pixel = view.project(element.point_m, &jacobian);
  if (!pixel) return std::nullopt;
  return ViewedElement{*pixel, jacobian * element.tangents};
}

ViewMatcher::ViewMatcher(const std::vector<CameraView>& views, const std::vector<GrayImage>& images,
                         const SurfaceOptions& options)
    : views_(views), options_(options) {
  for (const GrayImage& image : images) {
    prepared_.push_back(image.width > 0 ? std::make_unique<View>(image, options.correlate.match)
                                        : nullptr);
  }
}

bool ViewMatcher::subsetInside(int view, const Vec2& pixel) const {
  const double r = options_.correlate.match.subset_px / 2 + 0.5;
  const CameraModel& model = views_[view].model;
  return pixel.x() >= r && pixel.y() >= r && pixel.x() <= model.widthPx() - 1 - r &&
         pixel.y() <= model.heightPx() - 1 - r;
}

int ViewMatcher::frontView(const SurfaceElement& element) const {
  const Vec3 normal = normalOf(element);
  int best = -1;
  double best_cosine = kLeastCosine;
  for (int k = 0; k < static_cast<int>(views_.size()); ++k) {
    if (!prepared_[k]) continue;
    const double cosine = std::abs(normal.dot((views_[k].centre() - element.point_m).normalized()));
    if (cosine <= best_cosine) continue;
    const auto pixel = views_[k].project(element.point_m);
    if (!pixel || !subsetInside(k, *pixel)) continue;
    best = k;
    best_cosine = cosine;
  }
  return best;
}

double ViewMatcher::halfSubset_m(const SurfaceElement& element) const {
  const double half_px = options_.correlate.match.subset_px / 2 + 1.0;
  double largest = 0.0;
  for (std::size_t k = 0; k < views_.size(); ++k) {
    if (!prepared_[k]) continue;
    const auto seen = viewElement(views_[k], element);
    if (!seen || !subsetInside(static_cast<int>(k), seen->pixel)) continue;
    // Along each tangent: how far it reaches for the square's corners to be passed.
    const Mat2 inverse = seen->pixel_from_tangents.inverse();
    for (int axis = 0; axis < 2; ++axis) {
      const double reach = (std::abs(inverse(axis, 0)) + std::abs(inverse(axis, 1))) * half_px;
      largest = std::max(largest, reach * element.tangents.col(axis).norm());
    }
  }
  return largest;
}

std::optional<SeedSearch::Repeat> ViewMatcher::repeatOf(const SurfaceElement& element) const {
  const int front = frontView(element);
  if (front < 0) return std::nullopt;
  const GrayImage& image = prepared_[front]->reference.image();
  const SeedSearch search(image, image, options_.correlate.match.subset_px);
  return search.repeatOf(*views_[front].project(element.point_m));
}

ViewMatcher::Found ViewMatcher::findIn(int k, int front, const Subset& subset,
                                       const SurfaceElement& element, const SurfaceElement& centre,
                                       MatchScratch& scratch) const {
  Found found;
  const auto there = viewElement(views_[k], element);
  const auto middle = views_[k].project(centre.point_m);
  if (!there || !middle || !subsetInside(k, *middle)) return found;
  const View &reference = *prepared_[front], &deformed = *prepared_[k];
  CorrelatedPoint point;
  point.position = subset.seen.pixel;
  const SubsetWarp guess =
      SubsetWarp::affine(there->pixel - subset.seen.pixel,
                         there->pixel_from_tangents * subset.seen.pixel_from_tangents.inverse());
  point.match =
      reference.matcher->match(deformed.spline, subset.seen.pixel, subset.middle, guess, scratch);
  found.state = MatchJudge(reference.ends, deformed.ends, options_.correlate).stateOf(point);
  // The noise of the front view's subset moves all matches alike; half of each match's variance is
  // of that subset, and is given to its own sighting.
  const Mat2 linear = point.match.warp.linear(), back = linear.inverse();
  const Mat2 half = 0.5 * point.match.covariance_px2;
  const Vec2 pixel = subset.seen.pixel + point.match.warp.displacement();
  found.sighting = {{k, pixel, half}, pixel + linear * (subset.middle - subset.seen.pixel)};
  found.front_covariance_px2 = back * half * back.transpose();
  found.zncc = point.match.zncc;
  return found;
}

/// Triangulates a vertex; sightings that contradict the others are left out, worst first.
void ViewMatcher::settle(const Vec3& guess, RestVertex& vertex) const {
  std::vector<Sighting> sightings;
  while (vertex.sightings.size() >= 2) {
    sightings.clear();
    for (const VertexSighting& s : vertex.sightings) sightings.push_back(s.sighting);
    const auto point = triangulate(views_, sightings, &guess);
    vertex.state = PointState::kNotFound;
    if (!point) return;
    vertex.point = *point;
    const double freedom = 2.0 * static_cast<double>(sightings.size()) - 3.0;
    const bool fit = point->chi2 <= kLargestChi * kLargestChi * freedom ||
                     point->residual_px <= kFixedShare * options_.max_residual_px;
    if (point->residual_px <= options_.max_residual_px && fit) {
      vertex.state = PointState::kValid;
      return;
    }
    vertex.state = PointState::kOutlier;
    // Without the front view nothing ties the others together.
    if (sightings.size() == 2 || point->worst == 0) return;
    vertex.sightings.erase(vertex.sightings.begin() + point->worst);
  }
}

RestVertex ViewMatcher::match(const SurfaceElement& element, const SurfaceElement& centre,
                              MatchScratch& scratch) const {
  RestVertex vertex;
  vertex.state = PointState::kOutside;
  const int front = frontView(centre);
  if (front < 0) return vertex;
  const auto here = viewElement(views_[front], element);
  const auto middle = views_[front].project(centre.point_m);
  if (!here || !middle) return vertex;
  const Subset subset{*here, *middle};
  VertexSighting own{{front, here->pixel, Mat2::Zero()}, *middle};
  vertex.sightings.push_back(own);
  for (int k = 0; k < static_cast<int>(views_.size()); ++k) {
    if (k == front || !prepared_[k]) continue;
    const Found found = findIn(k, front, subset, element, centre, scratch);
    if (found.state != PointState::kValid) {
      if (vertex.sightings.size() == 1) vertex.state = found.state;
      continue;
    }
    vertex.zncc = vertex.sightings.size() == 1 ? found.zncc : std::min(vertex.zncc, found.zncc);
    vertex.sightings.push_back(found.sighting);
    own.sighting.covariance_px2 += found.front_covariance_px2;
  }
  if (vertex.sightings.size() < 2) return vertex;
  vertex.sightings.front().sighting.covariance_px2 =
      own.sighting.covariance_px2 / static_cast<double>(vertex.sightings.size() - 1);
  settle(element.point_m, vertex);
  return vertex;
}

}  // namespace tenter
