// SPDX-License-Identifier: GPL-3.0-or-later
#include "corner_refinement.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace tenter {

namespace {

constexpr double kWindowOfSpacing = 0.26;
constexpr int kMinHalfWindow_px = 2, kMaxHalfWindow_px = 30;
constexpr int kMaxIterations = 60;
constexpr double kStop_px = 1e-4;

double nearestNeighbour(int columns, const std::vector<cv::Point2f>& corners) {
  double nearest = 1e9;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i % columns != 0) nearest = std::min(nearest, cv::norm(corners[i] - corners[i - 1]));
    if (i >= static_cast<std::size_t>(columns)) {
      nearest = std::min(nearest, cv::norm(corners[i] - corners[i - columns]));
    }
  }
  return nearest;
}

}  // namespace

void refineCorners(const cv::Mat& image, double half_window_px, std::vector<cv::Point2f>& corners) {
  if (corners.empty()) return;
  const int half =
      std::clamp(static_cast<int>(half_window_px), kMinHalfWindow_px, kMaxHalfWindow_px);
  const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kMaxIterations,
                              kStop_px);
  cv::cornerSubPix(image, corners, cv::Size(half, half), cv::Size(-1, -1), stop);
}

void refineGridCorners(const cv::Mat& image, int columns, std::vector<cv::Point2f>& corners) {
  refineCorners(image, kWindowOfSpacing * nearestNeighbour(columns, corners), corners);
}

}  // namespace tenter
