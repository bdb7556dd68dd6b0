// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/correlate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "grid_propagation.h"
#include "image_checks.h"
#include "parallel_for.h"
#include "stopwatch.h"

namespace tenter {

namespace {

constexpr int kMostPoints = 2'000'000;
/// Nodes around a point from which a match of it is begun.
constexpr std::size_t kGuesses = 3;

/// One pair of images, prepared.
class Pair {
 public:
  Pair(const GrayImage& reference, const GrayImage& deformed, const CorrelateOptions& options)
      : options_(options),
        reference_(reference),
        deformed_(deformed),
        search_(reference_.image(), deformed, options.match.subset_px),
        reference_ends_(reference),
        deformed_ends_(deformed),
        judge_(reference_ends_, deformed_ends_, options) {
    warnOfImages(reference_ends_.share(), deformed_ends_.share(), sharpnessOf(reference),
                 sharpnessOf(deformed), warnings);
  }

  std::vector<CorrelatedPoint> matchGrid(const PointGrid& grid) {
    GridPropagation propagation(reference_, deformed_, search_, grid, options_);
    propagation.run();
    std::vector<CorrelatedPoint> nodes(static_cast<std::size_t>(grid.size()));
    const auto& repeat = propagation.repeat();
    for (int i = 0; i < grid.size(); ++i) {
      nodes[i].position = grid.position(i);
      nodes[i].match = propagation.match(i);
      nodes[i].state = judge_.stateOf(nodes[i]);
      if (nodes[i].state == PointState::kNotFound && repeat) {
        nodes[i].state = PointState::kAmbiguous;
      }
    }
    if (repeat) {
      const Vec2& by = repeat->offset_px;
      warnings.push_back("the texture repeats: a piece of it occurs again (" +
                         std::to_string(std::lround(by.x())) + ", " +
                         std::to_string(std::lround(by.y())) + ") px away");
    }
    dropOutliers(grid, nodes);
    return nodes;
  }

  /// Matches points of their own from the nodes around them.
  std::vector<CorrelatedPoint> matchPoints(const PointGrid& grid,
                                           const std::vector<CorrelatedPoint>& nodes,
                                           const std::vector<Vec2>& positions) const {
    const SubsetMatcher matcher(reference_, options_.match);
    std::vector<MatchScratch> scratch(static_cast<std::size_t>(std::max(options_.threads, 1)));
    std::vector<CorrelatedPoint> points(positions.size());
    parallelFor(points.size(), options_.threads, [&](std::size_t i, std::size_t worker) {
      points[i].position = positions[i];
      const auto around = nodesAround(grid, nodes, positions[i]);
      if (around.empty()) points[i].state = stateNear(grid, nodes, positions[i]);
      matchFrom(matcher, around, points[i], scratch[worker]);
      if (points[i].valid() && !agreesWithNeighbours(points[i], around)) {
        points[i].state = PointState::kOutlier;
      }
    });
    return points;
  }

  std::vector<std::string> warnings;

 private:
  static void dropOutliers(const PointGrid& grid, std::vector<CorrelatedPoint>& nodes) {
    std::vector<int> outliers;
    for (int i = 0; i < grid.size(); ++i) {
      if (!nodes[i].valid()) continue;
      std::vector<const CorrelatedPoint*> around;
      for (const int other : grid.neighbours(i)) {
        if (nodes[other].valid()) around.push_back(&nodes[other]);
      }
      if (!agreesWithNeighbours(nodes[i], around)) outliers.push_back(i);
    }
    for (const int i : outliers) nodes[i].state = PointState::kOutlier;
  }

  /// Valid nodes of the 4 x 4 around a point, nearest first.
  static std::vector<const CorrelatedPoint*> nodesAround(const PointGrid& grid,
                                                         const std::vector<CorrelatedPoint>& nodes,
                                                         const Vec2& point) {
    std::vector<const CorrelatedPoint*> around;
    const Vec2 cell = (point - grid.position(0)) / grid.step_px;
    const int column = static_cast<int>(std::floor(cell.x()));
    const int row = static_cast<int>(std::floor(cell.y()));
    for (int r = std::max(row - 1, 0); r <= std::min(row + 2, grid.rows - 1); ++r) {
      for (int c = std::max(column - 1, 0); c <= std::min(column + 2, grid.columns - 1); ++c) {
        const CorrelatedPoint& node = nodes[grid.index(c, r)];
        if (node.valid()) around.push_back(&node);
      }
    }
    std::stable_sort(around.begin(), around.end(),
                     [&](const CorrelatedPoint* left, const CorrelatedPoint* right) {
                       return (left->position - point).norm() < (right->position - point).norm();
                     });
    return around;
  }

  /// Why there is no valid node around a point.
  PointState stateNear(const PointGrid& grid, const std::vector<CorrelatedPoint>& nodes,
                       const Vec2& point) const {
    const int r = options_.match.subset_px / 2;
    if (point.x() < r - 0.5 || point.y() < r - 0.5 || point.x() >= reference_.width() - r - 0.5 ||
        point.y() >= reference_.height() - r - 0.5) {
      return PointState::kOutside;
    }
    const Vec2 cell = (point - grid.position(0)) / grid.step_px;
    const auto nearest = [](double place, int count) {
      return std::clamp(static_cast<int>(std::lround(place)), 0, count - 1);
    };
    const PointState state =
        nodes[grid.index(nearest(cell.x(), grid.columns), nearest(cell.y(), grid.rows))].state;
    return state == PointState::kValid ? PointState::kNotFound : state;
  }

  void matchFrom(const SubsetMatcher& matcher, const std::vector<const CorrelatedPoint*>& around,
                 CorrelatedPoint& point, MatchScratch& scratch) const {
    for (std::size_t k = 0; k < std::min(around.size(), kGuesses); ++k) {
      const Vec2 offset = point.position - around[k]->position;
      const SubsetWarp guess = around[k]->match.warp.movedBy(offset);
      point.match = matcher.match(deformed_, point.position, guess, scratch);
      point.state = judge_.stateOf(point);
      if (point.valid()) return;
    }
  }

  const CorrelateOptions& options_;
  GradientImage reference_;
  SplineImage deformed_;
  SeedSearch search_;
  SaturationMap reference_ends_, deformed_ends_;
  MatchJudge judge_;
};

/// The whole grid that fits between two places, both inclusive.
PointGrid gridBetween(int x0, int y0, int x1, int y1, int step_px) {
  return {x0, y0, (x1 - x0) / step_px + 1, (y1 - y0) / step_px + 1, step_px};
}

PointGrid gridOver(int width, int height, int subset_px, int step_px) {
  const int r = subset_px / 2;
  return gridBetween(r, r, width - 1 - r, height - 1 - r, step_px);
}

/// A grid that reaches one step beyond the points, as far as subsets fit into the image.
PointGrid supportOf(const std::vector<Vec2>& points, const GrayImage& image, int subset_px) {
  const int r = subset_px / 2, step = std::max(4, r);
  Vec2 least = points.front(), most = points.front();
  for (const Vec2& point : points) {
    least = least.cwiseMin(point);
    most = most.cwiseMax(point);
  }
  const auto bounded = [r](double place, int size) {
    return std::clamp(static_cast<int>(place), r, size - 1 - r);
  };
  const int reach = 2 * step;
  return gridBetween(
      bounded(least.x() - reach, image.width), bounded(least.y() - reach, image.height),
      bounded(most.x() + reach, image.width), bounded(most.y() + reach, image.height), step);
}

}  // namespace

std::string_view nameOf(PointState state) {
  constexpr std::array<std::string_view, kPointStates> kNames = {
      "valid",           "outside",   "no_texture", "saturated", "not_found",
      "low_correlation", "uncertain", "ambiguous",  "outlier"};
  return kNames[static_cast<std::size_t>(state)];
}

double CorrelatedPoint::sigma_px() const { return std::sqrt(0.5 * match.covariance_px2.trace()); }

std::size_t CorrelationField::count(PointState state) const {
  return static_cast<std::size_t>(
      std::count_if(points.begin(), points.end(),
                    [state](const CorrelatedPoint& p) { return p.state == state; }));
}

std::vector<Vec2> gridPoints(int width, int height, int subset_px, int step_px) {
  require(step_px > 0, "the step of a grid is positive");
  const PointGrid grid = gridOver(width, height, subset_px, step_px);
  std::vector<Vec2> points;
  for (int i = 0; i < grid.size(); ++i) points.push_back(grid.position(i));
  return points;
}

Result<CorrelationField> correlateGrid(const GrayImage& reference, const GrayImage& deformed,
                                       int step_px, const CorrelateOptions& options) {
  const Stopwatch watch;
  if (step_px < 1) return usageError("--step must be at least 1");
  if (auto ok = checkPair(reference, deformed, options); !ok) return ok.error();
  const PointGrid grid =
      gridOver(reference.width, reference.height, options.match.subset_px, step_px);
  if (static_cast<std::int64_t>(grid.columns) * grid.rows > kMostPoints) {
    return usageError("a grid of that --step has more than " + std::to_string(kMostPoints) +
                      " points in these images");
  }
  CorrelationField field;
  Pair pair(reference, deformed, options);
  field.points = pair.matchGrid(grid);
  field.warnings = std::move(pair.warnings);
  watch.read(field);
  return field;
}

Result<CorrelationField> correlatePoints(const GrayImage& reference, const GrayImage& deformed,
                                         const std::vector<Vec2>& points,
                                         const CorrelateOptions& options) {
  const Stopwatch watch;
  if (auto ok = checkPair(reference, deformed, options); !ok) return ok.error();
  if (auto ok = checkPoints(reference, points); !ok) return ok.error();
  CorrelationField field;
  Pair pair(reference, deformed, options);
  const PointGrid grid = supportOf(points, reference, options.match.subset_px);
  field.points = pair.matchPoints(grid, pair.matchGrid(grid), points);
  field.warnings = std::move(pair.warnings);
  watch.read(field);
  return field;
}

}  // namespace tenter
