// SPDX-License-Identifier: GPL-3.0-or-later
// Tracked points a second on one core, and the errors, beside OpenCV's dense inverse search [Kro16]
// and pyramidal Lucas-Kanade on the same images. Motion: up to 7 px in waves of up to 4 % strain; 2
// grey levels of noise.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <opencv2/video/tracking.hpp>

#include "speckle.h"
#include "tenter/reconstruction/correlate.h"
#include "tenter/reconstruction/point_tracker.h"

namespace tenter::reconstruction_test {
namespace {

double threadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// A smooth motion with its inverse by fixed-point steps.
Vec2 motion(const Vec2& x, double side) {
  const Vec2 s = x / side - Vec2(0.5, 0.5);
  const double turn = 2.0 * std::numbers::pi;
  return {3.0 + 4.0 * s.x() + 1.5 * std::sin(turn * 4.0 * s.y()),
          -2.0 + 4.0 * s.y() + 1.5 * std::cos(turn * 3.0 * s.x())};
}

Vec2 materialAt(const Vec2& place, double side) {
  Vec2 x = place;
  for (int i = 0; i < 20; ++i) x = place - motion(x, side);
  return x;
}

cv::Mat eightBits(const GrayImage& image) {
  cv::Mat result;
  matrixOf(image).convertTo(result, CV_8U);
  return result;
}

struct Score {
  double squares = 0.0, worst = 0.0;
  int count = 0;
  void add(const Vec2& error) {
    squares += 0.5 * error.squaredNorm();
    worst = std::max(worst, error.norm());
    ++count;
  }
  void print(const char* name, std::size_t asked, double seconds) const {
    std::printf("%-34s %6zu points, %6d found, RMS %.4f px, worst %.3f px, %8.0f points/s/core\n",
                name, asked, count, std::sqrt(squares / std::max(count, 1)), worst,
                static_cast<double>(asked) / seconds);
  }
};

struct Scene {
  GrayImage before, after;
  double side;
  std::vector<Vec2> points;
};

Score scoreOf(const CorrelationField& field, double side) {
  Score score;
  for (const CorrelatedPoint& point : field.points) {
    if (point.valid()) score.add(point.match.warp.displacement() - motion(point.position, side));
  }
  return score;
}

void ours(const Scene& scene, int order, int subset_px) {
  CorrelateOptions options;
  options.match.order = order;
  options.match.subset_px = subset_px;
  auto tracker = PointTracker::create(scene.before, scene.points, options).value();
  const double begin = threadSeconds();
  const auto tracked = tracker.track(scene.after).value();
  const double seconds = threadSeconds() - begin;
  char name[64];
  std::snprintf(name, sizeof name, "tracked, order %d, %d px", order, subset_px);
  scoreOf(tracked, scene.side).print(name, scene.points.size(), seconds);
  std::snprintf(name, sizeof name, "from nothing, order %d, %d px", order, subset_px);
  const double start = threadSeconds();
  const auto found = correlatePoints(scene.before, scene.after, scene.points, options).value();
  scoreOf(found, scene.side).print(name, scene.points.size(), threadSeconds() - start);
}

void denseFlow(const Scene& scene, int preset, const char* name) {
  const cv::Mat before = eightBits(scene.before), after = eightBits(scene.after);
  const auto flow = cv::DISOpticalFlow::create(preset);
  const double begin = threadSeconds();
  cv::Mat moved;
  flow->calc(before, after, moved);
  const double seconds = threadSeconds() - begin;
  Score score;
  for (const Vec2& point : scene.points) {
    const auto v = moved.at<cv::Vec2f>(static_cast<int>(point.y()), static_cast<int>(point.x()));
    score.add(Vec2(v[0], v[1]) - motion(point, scene.side));
  }
  score.print(name, scene.points.size(), seconds);
}

void lucasKanade(const Scene& scene, int window_px) {
  const cv::Mat before = eightBits(scene.before), after = eightBits(scene.after);
  std::vector<cv::Point2f> from, to;
  for (const Vec2& point : scene.points) {
    from.emplace_back(static_cast<float>(point.x()), static_cast<float>(point.y()));
  }
  std::vector<uchar> status;
  std::vector<float> errors;
  const double begin = threadSeconds();
  cv::calcOpticalFlowPyrLK(before, after, from, to, status, errors, cv::Size(window_px, window_px),
                           3, cv::TermCriteria(3, 30, 0.001));
  const double seconds = threadSeconds() - begin;
  Score score;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec2 moved(static_cast<double>(to[i].x - from[i].x),
                     static_cast<double>(to[i].y - from[i].y));
    if (status[i] != 0) score.add(moved - motion(scene.points[i], scene.side));
  }
  char name[64];
  std::snprintf(name, sizeof name, "OpenCV pyramidal LK, %d px", window_px);
  score.print(name, scene.points.size(), seconds);
}

int run(int side, int step) {
  const SpeckleTexture texture(7);
  Scene scene;
  scene.side = side;
  scene.before = photographed(seen(texture, side, side), 2.0, 1);
  scene.after = photographed(
      seen(texture, side, side, [side](const Vec2& x) { return materialAt(x, side); }), 2.0, 2);
  const int margin = 40;
  for (int y = margin; y < side - margin; y += step) {
    for (int x = margin; x < side - margin; x += step) scene.points.emplace_back(x, y);
  }
  cv::setNumThreads(1);
  std::printf("%d x %d pixels\n", side, side);
  for (const int subset_px : {21, 31}) {
    for (const int order : {1, 2}) ours(scene, order, subset_px);
  }
  denseFlow(scene, cv::DISOpticalFlow::PRESET_FAST, "OpenCV DIS, fast");
  denseFlow(scene, cv::DISOpticalFlow::PRESET_MEDIUM, "OpenCV DIS, medium");
  lucasKanade(scene, 21);
  lucasKanade(scene, 31);
  return 0;
}

}  // namespace
}  // namespace tenter::reconstruction_test

int main(int argc, char** argv) {
  CLI::App app{"Correlation beside optical flow: speed and error"};
  int side = 1000, step = 9;
  app.add_option("--side", side, "Of the square images [px]")->check(CLI::Range(200, 4000));
  app.add_option("--step", step, "Between points [px]")->check(CLI::Range(1, 100));
  CLI11_PARSE(app, argc, argv);
  return tenter::reconstruction_test::run(side, step);
}
