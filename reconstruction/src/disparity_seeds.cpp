// SPDX-License-Identifier: GPL-3.0-or-later
#include "disparity_seeds.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

namespace tenter {

namespace {

constexpr int kHalf_px = 16;      ///< Of a piece.
constexpr int kRows = 2;          ///< What calibration may err across the rows, each side.
constexpr int kSeedsAcross = 16;  ///< Places tried along the longer side.
/// Correlation of a seed, and of one that makes further stretches needless.
constexpr double kLeastZncc = 0.55, kGoodZncc = 0.85;
/// Structure of a piece worth searching [grey levels RMS].
constexpr double kLeastDeviation = 3.0;
/// A second place that fits so well beside the best makes a seed useless.
constexpr double kSecond = 0.88;
constexpr int kPeakApart_px = 6;
/// How a piece may be stretched along its rows and sheared from row to row.
constexpr double kStretches[] = {1.0, 0.8, 1.25, 0.65, 1.5};
constexpr double kShears[] = {0.0, 0.15, -0.15, 0.3, -0.3, 0.45, -0.45};
/// Once so many seeds were found, only the shapes that most of them had are tried.
constexpr int kEnoughSeeds = 10;
constexpr std::size_t kUsualShapes = 3;
constexpr int kLeastSeeds = 12, kTrials = 500;
/// Seeds so near to a plane vote for it, as a share of the image's width.
constexpr double kVote = 0.012;
/// Seeds farther than this many votes from the best plane are wrong.
constexpr double kFar = 4.0;
constexpr double kMargin_px = 12.0;

struct Seed {
  double x, y, disparity;
};

/// The best place of a piece in a strip; nothing if none is good or another is nearly as good.
std::optional<std::pair<double, double>> bestColumn(const cv::Mat& strip, const cv::Mat& piece) {
  cv::Mat map;
  cv::matchTemplate(strip, piece, map, cv::TM_CCOEFF_NORMED);
  double best = 0.0, second = 0.0;
  cv::Point at;
  cv::minMaxLoc(map, nullptr, &best, nullptr, &at);
  if (best < kLeastZncc || best > 1.0 + 1e-3) return std::nullopt;
  for (int x = 0; x < map.cols; ++x) {
    if (std::abs(x - at.x) <= kPeakApart_px) continue;
    for (int y = 0; y < map.rows; ++y) second = std::max(second, double{map.at<float>(y, x)});
  }
  if (second > kSecond * best) return std::nullopt;
  return std::make_pair(static_cast<double>(at.x), best);
}

/// How pieces were deformed between the images, the usual ways first.
class Shapes {
 public:
  struct Shape {
    double stretch, shear;
    int seeds = 0;
  };

  Shapes() {
    for (const double shear : kShears) {
      for (const double stretch : kStretches) shapes_.push_back({stretch, shear});
    }
  }

  std::vector<std::size_t> order() const {
    std::vector<std::size_t> order(shapes_.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
      return shapes_[a].seeds > shapes_[b].seeds;
    });
    if (found_ >= kEnoughSeeds) order.resize(kUsualShapes);
    return order;
  }
  const Shape& operator[](std::size_t i) const { return shapes_[i]; }
  void count(std::size_t i) {
    ++shapes_[i].seeds;
    ++found_;
  }

 private:
  std::vector<Shape> shapes_;
  int found_ = 0;
};

/// A piece of A around a pixel, stretched along its rows and sheared.
cv::Mat pieceAround(const cv::Mat& a, cv::Point at, const Shapes::Shape& shape) {
  const int half = static_cast<int>(std::lround(kHalf_px * shape.stretch));
  // From the piece's pixels to A's.
  const double along = 1.0 / shape.stretch, across = -shape.shear / shape.stretch;
  const cv::Matx23d from_piece(along, across, at.x - along * half - across * kHalf_px, 0.0, 1.0,
                               at.y - kHalf_px);
  cv::Mat piece;
  cv::warpAffine(a, piece, from_piece, cv::Size(2 * half + 1, 2 * kHalf_px + 1),
                 cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  return piece;
}

std::optional<Seed> seedAt(const cv::Mat& a, const cv::Mat& b, cv::Point at, double least,
                           double most, Shapes& shapes) {
  cv::Scalar mean, deviation;
  const int side = 2 * kHalf_px + 1;
  cv::meanStdDev(a(cv::Rect(at.x - kHalf_px, at.y - kHalf_px, side, side)), mean, deviation);
  if (deviation[0] < kLeastDeviation) return std::nullopt;
  std::optional<Seed> best;
  std::size_t best_shape = 0;
  double best_zncc = 0.0;
  for (const std::size_t i : shapes.order()) {
    const cv::Mat piece = pieceAround(a, at, shapes[i]);
    const int half = piece.cols / 2;
    const int left = std::max(0, static_cast<int>(at.x - most) - half);
    const int right = std::min(b.cols, static_cast<int>(at.x - least) + half + 1);
    const int top = std::max(0, at.y - kHalf_px - kRows);
    const int bottom = std::min(b.rows, at.y + kHalf_px + kRows + 1);
    if (right - left < piece.cols || bottom - top < side) continue;
    const auto found = bestColumn(b(cv::Rect(left, top, right - left, bottom - top)), piece);
    if (!found || found->second <= best_zncc) continue;
    best_zncc = found->second;
    best_shape = i;
    best = Seed{double(at.x), double(at.y), at.x - (left + found->first + half)};
    if (best_zncc > kGoodZncc) break;
  }
  if (best) shapes.count(best_shape);
  return best;
}

double distance(const Vec3& plane, const Seed& seed) {
  return seed.disparity - (plane.x() * seed.x + plane.y() * seed.y + plane.z());
}

std::vector<const Seed*> near(const std::vector<Seed>& seeds, const Vec3& plane, double limit_px) {
  std::vector<const Seed*> close;
  for (const Seed& seed : seeds) {
    if (std::abs(distance(plane, seed)) <= limit_px) close.push_back(&seed);
  }
  return close;
}

Vec3 fit(const std::vector<const Seed*>& seeds) {
  Eigen::MatrixX3d rows(static_cast<Eigen::Index>(seeds.size()), 3);
  Eigen::VectorXd values(rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    rows.row(i) << seeds[i]->x, seeds[i]->y, 1.0;
    values(i) = seeds[i]->disparity;
  }
  return rows.colPivHouseholderQr().solve(values);
}

std::vector<Seed> sow(const cv::Mat& a, const cv::Mat& mask_a, const cv::Mat& b, double least,
                      double most) {
  std::vector<Seed> seeds;
  Shapes shapes;
  const int step = std::max(8, std::max(a.cols, a.rows) / kSeedsAcross);
  for (int y = kHalf_px; y + kHalf_px < a.rows; y += step) {
    for (int x = kHalf_px; x + kHalf_px < a.cols; x += step) {
      const cv::Rect around(x - kHalf_px, y - kHalf_px, 2 * kHalf_px + 1, 2 * kHalf_px + 1);
      if (cv::countNonZero(mask_a(around)) < around.area()) continue;
      if (const auto seed = seedAt(a, b, {x, y}, least, most, shapes)) seeds.push_back(*seed);
    }
  }
  return seeds;
}

}  // namespace

std::optional<DisparityPlane> findDisparityPlane(const cv::Mat& a, const cv::Mat& mask_a,
                                                 const cv::Mat& b, double least, double most) {
  const std::vector<Seed> seeds = sow(a, mask_a, b, least, most);
  if (seeds.size() < kLeastSeeds) return std::nullopt;
  const double vote_px = kVote * a.cols;
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> any(0, seeds.size() - 1);
  std::vector<const Seed*> best;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::vector<const Seed*> three = {&seeds[any(random)], &seeds[any(random)],
                                            &seeds[any(random)]};
    const Vec3 plane = fit(three);
    if (!plane.allFinite() || std::abs(plane.x()) > 0.9) continue;
    auto close = near(seeds, plane, vote_px);
    if (close.size() > best.size()) best = std::move(close);
  }
  if (best.size() < kLeastSeeds) return std::nullopt;
  DisparityPlane result{fit(best), 0.0, 0.0, 0};
  best = near(seeds, result.plane, kFar * vote_px);
  result.seeds = static_cast<int>(best.size());
  for (const Seed* seed : best) {
    result.least_px = std::min(result.least_px, distance(result.plane, *seed));
    result.most_px = std::max(result.most_px, distance(result.plane, *seed));
  }
  result.least_px -= kMargin_px;
  result.most_px += kMargin_px;
  return result;
}

}  // namespace tenter
