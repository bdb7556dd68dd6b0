// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/point_tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/video/tracking.hpp>

#include "eight_bits.h"
#include "image_checks.h"
#include "match_checks.h"
#include "neighbour_lists.h"
#include "opencv_threads.h"
#include "parallel_for.h"
#include "stopwatch.h"

namespace tenter {

namespace {

constexpr std::size_t kNeighbours = 8;
/// Rounds in which lost points are looked for from their neighbours; each reaches one further.
constexpr int kRecoveries = 10;
/// A match may lie so far from where flow carried the point; flow errs by less, and the next
/// grain of the texture is further away.
constexpr double kJump_px = 2.0;

/// Flow at a place, that of the nearest pixel; outside that of the border.
Vec2 flowAt(const cv::Mat& flow, const Vec2& place) {
  const auto pixel = [](double value, int size) {
    return static_cast<int>(std::lround(std::clamp(value, 0.0, size - 1.0)));
  };
  const auto& v = flow.at<cv::Vec2f>(pixel(place.y(), flow.rows), pixel(place.x(), flow.cols));
  return {v[0], v[1]};
}

}  // namespace

struct PointTracker::State {
  State(const GrayImage& image, std::vector<Vec2> tracked, std::vector<Vec2> subsets,
        const CorrelateOptions& wanted)
      : options(wanted),
        reference(image),
        matcher(reference, options.match),
        ends(image),
        sharpness(sharpnessAround(image, tracked)),
        points(std::move(tracked)),
        centres(subsets.empty() ? points : std::move(subsets)),
        neighbours(neighbourLists(points, kNeighbours)),
        last(points.size()),
        scratch(static_cast<std::size_t>(std::max(options.threads, 1))),
        previous(eightBits(image)),
        flow(cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_FAST)) {}
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  std::vector<SubsetWarp> predict(const cv::Mat& next);
  void matchAll(const SplineImage& deformed, const MatchJudge& judge,
                const std::vector<SubsetWarp>& guesses, std::vector<CorrelatedPoint>& found);
  void recover(const SplineImage& deformed, const MatchJudge& judge,
               std::vector<CorrelatedPoint>& found);
  void dropOutliers(std::vector<CorrelatedPoint>& found) const;
  int bestNeighbour(int i, const std::vector<CorrelatedPoint>& found) const;
  CorrelatedPoint matchFrom(int i, const SubsetWarp& guess, const SplineImage& deformed,
                            const MatchJudge& judge, MatchScratch& memory) const;

  const CorrelateOptions options;
  const GradientImage reference;
  const SubsetMatcher matcher;
  const SaturationMap ends;
  const double sharpness;
  const std::vector<Vec2> points, centres;
  const std::vector<std::vector<int>> neighbours;
  std::vector<SubsetWarp> last;  ///< Where each point was in the image before.
  std::vector<MatchScratch> scratch;
  cv::Mat previous;
  cv::Ptr<cv::DISOpticalFlow> flow;
};

/// The last motions, carried on by optical flow from the previous image.
std::vector<SubsetWarp> PointTracker::State::predict(const cv::Mat& next) {
  const OpencvThreads threads(options.threads);
  cv::Mat moved;
  flow->calc(previous, next, moved);
  std::vector<SubsetWarp> guesses = last;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec2 by = flowAt(moved, points[i] + last[i].displacement());
    guesses[i].u[0] += by.x();
    guesses[i].v[0] += by.y();
  }
  return guesses;
}

CorrelatedPoint PointTracker::State::matchFrom(int i, const SubsetWarp& guess,
                                               const SplineImage& deformed, const MatchJudge& judge,
                                               MatchScratch& memory) const {
  CorrelatedPoint point;
  point.position = points[i];
  point.match = matcher.match(deformed, points[i], centres[i], guess, memory);
  const Vec2 jump = point.match.warp.displacement() - guess.displacement();
  if (jump.norm() > kJump_px) point.match.end = MatchEnd::kDiverged;
  point.state = judge.stateOf(point);
  return point;
}

void PointTracker::State::matchAll(const SplineImage& deformed, const MatchJudge& judge,
                                   const std::vector<SubsetWarp>& guesses,
                                   std::vector<CorrelatedPoint>& found) {
  parallelFor(points.size(), options.threads, [&](std::size_t i, std::size_t worker) {
    found[i] = matchFrom(static_cast<int>(i), guesses[i], deformed, judge, scratch[worker]);
  });
}

/// The valid neighbour of point i that correlates best, or -1.
int PointTracker::State::bestNeighbour(int i, const std::vector<CorrelatedPoint>& found) const {
  int best = -1;
  for (const int other : neighbours[i]) {
    if (!found[other].valid()) continue;
    if (best < 0 || found[other].match.zncc > found[best].match.zncc) best = other;
  }
  return best;
}

/// Tries lost points again from the motion of a valid neighbour, until that helps no more.
void PointTracker::State::recover(const SplineImage& deformed, const MatchJudge& judge,
                                  std::vector<CorrelatedPoint>& found) {
  std::vector<int> tried(points.size(), -1);
  for (int round = 0; round < kRecoveries; ++round) {
    std::vector<std::pair<int, SubsetWarp>> tasks;
    for (int i = 0; i < static_cast<int>(points.size()); ++i) {
      if (found[i].valid()) continue;
      const int from = bestNeighbour(i, found);
      if (from < 0 || from == tried[i]) continue;
      tried[i] = from;
      tasks.emplace_back(i, found[from].match.warp.movedBy(points[i] - points[from]));
    }
    if (tasks.empty()) return;
    std::vector<CorrelatedPoint> again(tasks.size());
    parallelFor(tasks.size(), options.threads, [&](std::size_t k, std::size_t worker) {
      again[k] = matchFrom(tasks[k].first, tasks[k].second, deformed, judge, scratch[worker]);
    });
    for (std::size_t k = 0; k < tasks.size(); ++k) {
      if (again[k].valid()) found[tasks[k].first] = again[k];
    }
  }
}

void PointTracker::State::dropOutliers(std::vector<CorrelatedPoint>& found) const {
  std::vector<std::size_t> outliers;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!found[i].valid()) continue;
    std::vector<const CorrelatedPoint*> around;
    for (const int other : neighbours[i]) {
      if (found[other].valid()) around.push_back(&found[other]);
    }
    if (!agreesWithNeighbours(found[i], around)) outliers.push_back(i);
  }
  for (const std::size_t i : outliers) found[i].state = PointState::kOutlier;
}

PointTracker::PointTracker(std::unique_ptr<State> state) : state_(std::move(state)) {}
PointTracker::PointTracker(PointTracker&&) noexcept = default;
PointTracker& PointTracker::operator=(PointTracker&&) noexcept = default;
PointTracker::~PointTracker() = default;

Result<PointTracker> PointTracker::create(const GrayImage& reference, std::vector<Vec2> points,
                                          const CorrelateOptions& options,
                                          std::vector<Vec2> centres) {
  if (auto ok = checkPair(reference, reference, options); !ok) return ok.error();
  if (auto ok = checkPoints(reference, points); !ok) return ok.error();
  require(centres.empty() || centres.size() == points.size(), "one subset a point");
  return PointTracker(
      std::make_unique<State>(reference, std::move(points), std::move(centres), options));
}

Result<CorrelationField> PointTracker::track(const GrayImage& image) {
  const Stopwatch watch;
  State& s = *state_;
  if (auto ok = checkPair(s.reference.image(), image, s.options); !ok) return ok.error();
  CorrelationField field;
  const SplineImage deformed(image);
  const SaturationMap ends(image);
  const MatchJudge judge(s.ends, ends, s.options);
  cv::Mat next = eightBits(image);
  const std::vector<SubsetWarp> guesses = s.predict(next);
  // What lies behind the cloth may be as dark as it likes, and clips as sharp.
  std::vector<Vec2> moved;
  double before = 0.0, after = 0.0;
  const double per_point = 1.0 / static_cast<double>(s.points.size());
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    const int side_px = s.options.match.subset_px;
    before += per_point * s.ends.share(s.points[i], side_px);
    moved.emplace_back(s.points[i] + guesses[i].displacement());
    after += per_point * ends.share(moved.back(), side_px);
  }
  warnOfImages(before, after, s.sharpness, sharpnessAround(image, moved), field.warnings);
  field.points.resize(s.points.size());
  s.matchAll(deformed, judge, guesses, field.points);
  s.recover(deformed, judge, field.points);
  s.dropOutliers(field.points);
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    s.last[i] = field.points[i].valid() ? field.points[i].match.warp : guesses[i];
  }
  s.previous = std::move(next);
  watch.read(field);
  return field;
}

void PointTracker::goOnFrom(const GrayImage& image, std::vector<SubsetWarp> warps) {
  const GrayImage& first = state_->reference.image();
  require(image.width == first.width && image.height == first.height, "images of one size");
  require(warps.size() == state_->points.size(), "one warp a point");
  state_->previous = eightBits(image);
  state_->last = std::move(warps);
}

}  // namespace tenter
