// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "tenter/core/result.h"
#include "tenter/reconstruction/camera_view.h"

namespace tenter {

/// Two views turned so that a point lies in the same row of both; columns run along the line that
/// joins the cameras. A pixel (x, y) of either stands for the direction (x + x0, y + y0, f); the
/// disparity of a point, in whole rectified coordinates, is f times baseline over depth.
class RectifiedPair {
 public:
  /// Nothing unless both cameras look to the same side of the line that joins them and see a common
  /// range of rows.
  static std::optional<RectifiedPair> make(const CameraView& a, const CameraView& b);

  int widthA() const { return width_a_; }
  int widthB() const { return width_b_; }
  int height() const { return height_; }
  double focal_px() const { return focal_px_; }
  /// Smallest and largest disparity that the two images can hold, in whole coordinates.
  double disparityOffset() const { return x0_a_ - x0_b_; }

  cv::Mat imageA(const cv::Mat& pixels) const;
  cv::Mat imageB(const cv::Mat& pixels) const;
  /// B as seen from A if all points had the disparities slope_x x + slope_y y + offset, (x, y) in
  /// A's columns and rows: what lies on that plane stands where it stands in A.
  cv::Mat imageBOverA(const cv::Mat& pixels, const Vec3& plane) const;
  /// 255 where a rectified pixel of A shows a pixel of the camera.
  cv::Mat maskA() const;

  /// Disparities, as slope_x x + slope_y y + offset, of the plane through a point. Precondition: it
  /// does not pass through the camera A.
  Vec3 disparitiesOf(const Vec3& point_m, const Vec3& normal) const;
  /// Point in space of a place in A [px] and its disparity in columns, xA - xB.
  Vec3 point(double x, double y, double disparity) const;
  /// Pixel of the camera A that stands at a place in A.
  std::optional<Vec2> pixelA(double x, double y) const;

 private:
  RectifiedPair(const CameraView& a, const CameraView& b) : a_(a), b_(b) {}
  bool layOut();
  cv::Mat lookUp(const CameraView& view, const cv::Mat& pixels, double x0, int width,
                 const Vec3& plane) const;

  CameraView a_, b_;
  Mat3 rectified_from_space_ = Mat3::Identity();
  double focal_px_ = 0.0, baseline_m_ = 0.0;
  double x0_a_ = 0.0, x0_b_ = 0.0, y0_ = 0.0;
  int width_a_ = 0, width_b_ = 0, height_ = 0;
};

}  // namespace tenter
