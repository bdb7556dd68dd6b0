// SPDX-License-Identifier: GPL-3.0-or-later
#include "seed_search.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace tenter {

namespace {

/// A template much smaller than this resembles too many places by chance.
constexpr int kLeastHalf_px = 20;
/// How far around the guess Reach::kNear looks.
constexpr int kNear_px = 48;
/// Peaks below this are chance.
constexpr double kLeastZncc = 0.4;
/// A template with less structure is not looked for [grey levels RMS].
constexpr double kLeastDeviation = 0.5;
/// Share of the template's contrast that a place must have.
constexpr double kLeastContrast = 0.1;
/// Two peaks nearer than this are one.
constexpr int kPeakApart_px = 5;
constexpr std::size_t kCandidates = 3;
/// Turns and stretches tried; a template still correlates when it is off by half a step.
constexpr double kTurn_deg = 12.0;
constexpr int kTurns = 4;
constexpr double kStretches[] = {1.0, 0.87, 1.15};

cv::Mat view(const GrayImage& image) {
  return cv::Mat(image.height, image.width, CV_32FC1, const_cast<float*>(image.pixels.data()));
}

double deviationOf(const cv::Mat& image) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  return deviation[0];
}

Mat2 turnedAndStretched(double degrees, double stretch) {
  return stretch * Eigen::Rotation2Dd(degrees * std::numbers::pi / 180.0).toRotationMatrix();
}

std::vector<Mat2> hypotheses() {
  std::vector<Mat2> all;
  for (const double stretch : kStretches) {
    for (int turn = 0; turn <= kTurns; ++turn) {
      for (const int sign : {1, -1}) {
        if (turn == 0 && (sign < 0 || stretch == 1.0)) continue;
        all.push_back(turnedAndStretched(sign * turn * kTurn_deg, stretch));
      }
    }
  }
  return all;
}

}  // namespace

SeedSearch::SeedSearch(const GrayImage& reference, const GrayImage& deformed, int subset_px)
    : reference_(view(reference)),
      deformed_(view(deformed)),
      half_px_(std::min({std::max(subset_px / 2, kLeastHalf_px), (reference.width - 1) / 2,
                         (reference.height - 1) / 2})) {}

/// The reference around a pixel as it looks after a linear map; nothing without structure.
std::optional<cv::Mat> SeedSearch::templateAround(const Vec2& point, const Mat2& linear) const {
  const Mat2 inverse = linear.inverse();
  const Vec2 corner = point - inverse * Vec2(half_px_, half_px_);
  const cv::Matx23d from_template(inverse(0, 0), inverse(0, 1), corner.x(), inverse(1, 0),
                                  inverse(1, 1), corner.y());
  cv::Mat result;
  cv::warpAffine(reference_, result, from_template, cv::Size(2 * half_px_ + 1, 2 * half_px_ + 1),
                 cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  if (!(deviationOf(result) > kLeastDeviation)) return std::nullopt;
  return result;
}

/// The highest local maxima of the correlation of `piece` with `image`, best first.
std::vector<SeedSearch::Peak> SeedSearch::peaks(const cv::Mat& image, const cv::Mat& piece,
                                                std::size_t count) {
  cv::Mat map, highest;
  cv::matchTemplate(image, piece, map, cv::TM_CCOEFF_NORMED);
  const int size = 2 * kPeakApart_px + 1;
  cv::dilate(map, highest, cv::Mat::ones(size, size, CV_8U));
  const double contrast = deviationOf(piece);
  std::vector<Peak> found;
  for (int y = 0; y < map.rows; ++y) {
    const auto *value = map.ptr<float>(y), *most = highest.ptr<float>(y);
    for (int x = 0; x < map.cols; ++x) {
      if (value[x] < kLeastZncc || value[x] != most[x]) continue;
      // Where an image is flat, what is left of rounding correlates with anything.
      const cv::Rect there(x, y, piece.cols, piece.rows);
      if (deviationOf(image(there)) > kLeastContrast * contrast)
        found.push_back({{x, y}, value[x]});
    }
  }
  const auto kept = std::min(found.size(), count);
  std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(kept), found.end(),
                    [](const Peak& p, const Peak& q) { return p.zncc > q.zncc; });
  found.resize(kept);
  return found;
}

std::vector<SubsetWarp> SeedSearch::find(const Vec2& point, const SubsetWarp& guess,
                                         Reach reach) const {
  const Vec2 pixel(std::round(point.x()), std::round(point.y()));
  const cv::Rect all(0, 0, deformed_.cols, deformed_.rows);
  cv::Rect window = all;
  std::vector<Mat2> linear_maps = {Mat2::Identity()};
  if (reach == Reach::kNear) {
    linear_maps = {guess.linear()};
    const Vec2 corner = pixel + guess.displacement();
    const int margin = half_px_ + kNear_px;
    window &= cv::Rect(static_cast<int>(corner.x()) - margin, static_cast<int>(corner.y()) - margin,
                       2 * margin + 1, 2 * margin + 1);
  } else if (reach == Reach::kTurned) {
    linear_maps = hypotheses();
  }
  std::vector<std::pair<double, SubsetWarp>> found;
  for (const Mat2& linear : linear_maps) {
    const auto piece = templateAround(pixel, linear);
    if (!piece || window.width < piece->cols || window.height < piece->rows) continue;
    for (const Peak& peak : peaks(deformed_(window), *piece, kCandidates)) {
      const Vec2 place(window.x + peak.place.x + half_px_, window.y + peak.place.y + half_px_);
      found.emplace_back(peak.zncc, SubsetWarp::affine(place - pixel, linear));
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<SubsetWarp> best;
  for (const auto& [zncc, warp] : found) {
    if (best.size() < kCandidates) best.push_back(warp.movedBy(point - pixel));
  }
  return best;
}

std::optional<SeedSearch::Repeat> SeedSearch::repeatOf(const Vec2& point) const {
  const Vec2 pixel(std::round(point.x()), std::round(point.y()));
  const auto piece = templateAround(pixel, Mat2::Identity());
  if (!piece) return std::nullopt;
  for (const Peak& peak : peaks(reference_, *piece, 2)) {
    const Vec2 offset = Vec2(peak.place.x + half_px_, peak.place.y + half_px_) - pixel;
    if (offset.norm() > kPeakApart_px) return Repeat{offset, peak.zncc};
  }
  return std::nullopt;
}

}  // namespace tenter
