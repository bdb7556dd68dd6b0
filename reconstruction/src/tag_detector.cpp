// SPDX-License-Identifier: GPL-3.0-or-later
#include "tag_detector.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/aruco.hpp>
#include <optional>

#include "eight_bits.h"
#include "tenter/calib/board.h"

namespace tenter {

namespace {

/// Of two squares nearer than this share of the perimeter OpenCV drops the inner one. The rim of a
/// white border one cell wide is 0.044 of it away: its default of 0.05 drops the tag.
constexpr double kLeastDistanceRate = 0.02;
/// Places along a side at which its edge is looked for, away from its rounded ends.
constexpr int kEdgePlaces = 24;
constexpr double kFirst = 0.12, kLast = 0.88;
/// How far across, as a share of the side, and at most [px].
constexpr double kReachShare = 0.11, kMostReach_px = 6.0, kLeastReach_px = 2.75;
constexpr double kStep_px = 0.25;
/// Slopes this near to the steepest belong to its edge.
constexpr double kBlur_px = 1.25;
constexpr double kLeastContrast = 10.0;  ///< Grey levels over an edge.
/// Edge places farther from their line than this many times the median are left out.
constexpr double kStray = 3.0, kStrayFixed_px = 0.05;
constexpr double kLargestScatter_px = 0.3;
constexpr std::size_t kLeastPlaces = 10;
/// What blur and sampling leave of a corner's error though its edges are straight [px].
constexpr double kCornerFloor_px = 0.01;

double bilinear(const GrayImage& image, const Vec2& at) {
  const double x = std::clamp(at.x(), 0.0, image.width - 1.001);
  const double y = std::clamp(at.y(), 0.0, image.height - 1.001);
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const double fx = x - ix, fy = y - iy;
  return (1.0 - fy) * ((1.0 - fx) * image.at(ix, iy) + fx * image.at(ix + 1, iy)) +
         fy * ((1.0 - fx) * image.at(ix, iy + 1) + fx * image.at(ix + 1, iy + 1));
}

/// Where an edge from dark to bright lies along `across` from `middle` [px]: the centroid of the
/// slopes around the steepest place.
std::optional<double> edgeAlong(const GrayImage& image, const Vec2& middle, const Vec2& across,
                                double reach) {
  const int half = static_cast<int>(reach / kStep_px);
  std::vector<double> values;
  for (int i = -half; i <= half; ++i)
    values.push_back(bilinear(image, middle + i * kStep_px * across));
  std::vector<double> slopes;
  for (std::size_t i = 0; i + 1 < values.size(); ++i) slopes.push_back(values[i + 1] - values[i]);
  const auto steepest = std::max_element(slopes.begin(), slopes.end());
  const auto at = static_cast<int>(steepest - slopes.begin());
  const int window = static_cast<int>(kBlur_px / kStep_px);
  if (at < window || at + window >= static_cast<int>(slopes.size())) return std::nullopt;
  double sum = 0.0, moment = 0.0;
  for (int i = at - window; i <= at + window; ++i) {
    const double slope = std::max(slopes[i], 0.0);
    sum += slope;
    moment += slope * (i + 0.5 - half);
  }
  if (sum < kLeastContrast * image.white / 255.0) return std::nullopt;
  return kStep_px * moment / sum;
}

struct Edge {
  Vec2 point, direction;
  double scatter_px;
};

/// Line through edge places, without strays.
std::optional<Edge> fitEdge(std::vector<Vec2> places) {
  Edge edge{};
  for (int round = 0; round < 3; ++round) {
    if (places.size() < kLeastPlaces) return std::nullopt;
    Vec2 mean = Vec2::Zero();
    for (const Vec2& place : places) mean += place / static_cast<double>(places.size());
    Mat2 scatter = Mat2::Zero();
    for (const Vec2& place : places) scatter += (place - mean) * (place - mean).transpose();
    const double angle = 0.5 * std::atan2(2.0 * scatter(0, 1), scatter(0, 0) - scatter(1, 1));
    edge.point = mean;
    edge.direction = Vec2(std::cos(angle), std::sin(angle));
    const Vec2 normal(-edge.direction.y(), edge.direction.x());
    std::vector<double> off;
    double squares = 0.0;
    for (const Vec2& place : places) {
      off.push_back(std::abs(normal.dot(place - mean)));
      squares += off.back() * off.back();
    }
    edge.scatter_px = std::sqrt(squares / (static_cast<double>(places.size()) - 2.0));
    std::vector<double> sorted = off;
    std::sort(sorted.begin(), sorted.end());
    const double limit = kStray * sorted[sorted.size() / 2] + kStrayFixed_px;
    std::vector<Vec2> kept;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (off[i] <= limit) kept.push_back(places[i]);
    }
    places = std::move(kept);
  }
  if (edge.scatter_px > kLargestScatter_px) return std::nullopt;
  return edge;
}

Vec2 intersection(const Edge& a, const Edge& b) {
  Mat2 columns;
  columns << a.direction, -b.direction;
  const Vec2 along = columns.inverse() * (b.point - a.point);
  return a.point + along.x() * a.direction;
}

/// Corners from the edges of the border; nothing if an edge is not whole.
bool refine(const GrayImage& image, SeenTag& tag) {
  const Vec2 middle = 0.25 * (tag.corners[0] + tag.corners[1] + tag.corners[2] + tag.corners[3]);
  std::array<Edge, 4> edges;
  double squares = 0.0;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec2 from = tag.corners[k], side = tag.corners[(k + 1) % 4] - from;
    const double length = side.norm();
    Vec2 across = Vec2(-side.y(), side.x()) / length;
    if (across.dot(from + 0.5 * side - middle) < 0.0) across = -across;
    const double reach = std::clamp(kReachShare * length, kLeastReach_px, kMostReach_px);
    std::vector<Vec2> places;
    for (int i = 0; i < kEdgePlaces; ++i) {
      const Vec2 at = from + side * (kFirst + (kLast - kFirst) * i / (kEdgePlaces - 1));
      if (const auto off = edgeAlong(image, at, across, reach))
        places.push_back(at + *off * across);
    }
    const auto edge = fitEdge(std::move(places));
    if (!edge) return false;
    edges[k] = *edge;
    squares += 0.25 * edge->scatter_px * edge->scatter_px;
  }
  for (std::size_t k = 0; k < 4; ++k) tag.corners[k] = intersection(edges[(k + 3) % 4], edges[k]);
  // A line of n places is known at its end to about twice its scatter over the root of n.
  tag.sigma_px = std::hypot(kCornerFloor_px, 2.0 * std::sqrt(squares / kEdgePlaces));
  return true;
}

}  // namespace

Result<std::vector<SeenTag>> findTags(const GrayImage& image,
                                      const std::set<std::string>& families) {
  const cv::Mat pixels = eightBits(image);
  std::vector<SeenTag> tags;
  for (const std::string& family : families) {
    const auto known = markerDictionaries();
    const auto row = std::find_if(known.begin(), known.end(),
                                  [&](const MarkerDictionary& d) { return d.name == family; });
    if (row == known.end()) {
      return badInput("", "tags", "'" + family + "' is no known family of tags");
    }
    const auto parameters = cv::aruco::DetectorParameters::create();
    parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
    parameters->minMarkerDistanceRate = kLeastDistanceRate;
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids;
    cv::aruco::detectMarkers(pixels, cv::aruco::getPredefinedDictionary(row->opencv_id), corners,
                             ids, parameters);
    for (std::size_t i = 0; i < ids.size(); ++i) {
      SeenTag tag{family, ids[i], {}, 0.0};
      for (std::size_t k = 0; k < 4; ++k) tag.corners[k] = Vec2(corners[i][k].x, corners[i][k].y);
      // The second time from where the first has led.
      if (refine(image, tag) && refine(image, tag)) tags.push_back(tag);
    }
  }
  return tags;
}

}  // namespace tenter
