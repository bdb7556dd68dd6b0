// SPDX-License-Identifier: GPL-3.0-or-later
#include "semi_global.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "disparity_seeds.h"
#include "rectified_pair.h"

namespace tenter {

namespace {

constexpr int kBlock_px = 5;
constexpr int kUniqueness_percent = 8;
constexpr int kDisagreement_px = 1;
constexpr int kSpeckle_px = 400, kSpeckleRange = 2;
constexpr int kClip = 63;
constexpr double kFixedPoint = 16.0;  ///< Disparities are sixteenths of a pixel.
constexpr int kMaxDisparities = 512;
/// Where an image varies less than this share of its median, semi-global matching only carries on
/// what it found beside it.
constexpr double kLeastTexture = 0.35;
constexpr int kTextureWindow_px = 7;

cv::Mat residualDisparity(const cv::Mat& a, const cv::Mat& b, int least, int count) {
  const int area = kBlock_px * kBlock_px;
  const auto matcher = cv::StereoSGBM::create(
      least, count, kBlock_px, 8 * area, 32 * area, kDisagreement_px, kClip, kUniqueness_percent,
      kSpeckle_px, kSpeckleRange, cv::StereoSGBM::MODE_SGBM);
  cv::Mat result;
  matcher->compute(a, b, result);
  return result;
}

/// Disparities of what lies near a known plane; nothing if that passes by the camera.
std::optional<DisparityPlane> planeOfPrior(const RectifiedPair& pair, const FlatPrior& prior,
                                           const CameraView& a) {
  const double distance_m = std::abs(prior.normal.dot(prior.point_m - a.centre()));
  if (!(distance_m > 2.0 * prior.thickness_m)) return std::nullopt;
  DisparityPlane plane{pair.disparitiesOf(prior.point_m, prior.normal), 0.0, 0.0, 0};
  // Disparity goes with the inverse of depth.
  const double middle = plane.plane.x() * 0.5 * pair.widthA() +
                        plane.plane.y() * 0.5 * pair.height() + plane.plane.z();
  const double whole = std::abs(middle + pair.disparityOffset());
  plane.most_px = whole * prior.thickness_m / (distance_m - prior.thickness_m);
  plane.least_px = -plane.most_px;
  return plane;
}

/// Standard deviation of grey levels around each pixel.
cv::Mat deviationMap(const cv::Mat& image) {
  cv::Mat values, mean, squares;
  image.convertTo(values, CV_32F);
  const cv::Size window(kTextureWindow_px, kTextureWindow_px);
  cv::boxFilter(values, mean, CV_32F, window);
  cv::sqrBoxFilter(values, squares, CV_32F, window);
  cv::Mat variance = cv::max(squares - mean.mul(mean), 0.0);
  cv::sqrt(variance, variance);
  return variance;
}

/// Of the places that have a disparity.
double medianDeviation(const cv::Mat& deviations, const cv::Mat& disparity, int least) {
  std::vector<float> values;
  for (int y = 0; y < disparity.rows; ++y) {
    for (int x = 0; x < disparity.cols; ++x) {
      if (disparity.at<short>(y, x) >= least) values.push_back(deviations.at<float>(y, x));
    }
  }
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Result<std::vector<SeenPoint>> semiGlobalPoints(const CameraView& a, const cv::Mat& image_a,
                                                const CameraView& b, const cv::Mat& image_b,
                                                int step_px, const FlatPrior* prior) {
  const std::string names = "'" + a.name + "' and '" + b.name + "'";
  const auto pair = RectifiedPair::make(a, b);
  if (!pair) {
    return badInput("", "", "cameras " + names + " do not look at a common place",
                    "is the calibration that of these cameras?");
  }
  const cv::Mat rectified_a = pair->imageA(image_a), mask = pair->maskA();
  const auto plane =
      prior ? planeOfPrior(*pair, *prior, a)
            : findDisparityPlane(rectified_a, mask, pair->imageB(image_b),
                                 std::max(1.0 - pair->widthB(), 1.0 - pair->disparityOffset()),
                                 pair->widthA());
  if (!plane) {
    return badInput("", "",
                    "cameras " + names + " show no common texture where the calibration says",
                    "are images or cameras exchanged, or is the calibration another rig's?");
  }
  const cv::Mat over_a = pair->imageBOverA(image_b, plane->plane);
  const int least = static_cast<int>(std::floor(plane->least_px));
  const int wanted = static_cast<int>(std::ceil(plane->most_px)) - least;
  const int count = std::min((wanted / 16 + 1) * 16, kMaxDisparities);
  const cv::Mat disparity = residualDisparity(rectified_a, over_a, least, count);
  const int least_fixed = least * static_cast<int>(kFixedPoint);
  const cv::Mat deviations = deviationMap(rectified_a);
  const double texture = kLeastTexture * medianDeviation(deviations, disparity, least_fixed);
  std::vector<SeenPoint> points;
  for (int y = 0; y < disparity.rows; y += step_px) {
    for (int x = 0; x < disparity.cols; x += step_px) {
      const auto value = disparity.at<short>(y, x);
      if (value < least_fixed || mask.at<uchar>(y, x) == 0) continue;
      if (deviations.at<float>(y, x) < texture) continue;
      const double column = x - value / kFixedPoint;
      const double b_column =
          column - (plane->plane.x() * column + plane->plane.y() * y + plane->plane.z());
      const double whole = x - b_column + pair->disparityOffset();
      const auto pixel = pair->pixelA(x, y);
      if (!(whole > 0.0) || !pixel) continue;
      points.push_back({pair->point(x, y, x - b_column), *pixel});
    }
  }
  return points;
}

}  // namespace tenter
