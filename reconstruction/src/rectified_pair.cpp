// SPDX-License-Identifier: GPL-3.0-or-later
#include "rectified_pair.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace tenter {

namespace {

/// Rectified images are kept below this by a shorter focal length [px].
constexpr double kMaxSide_px = 4000.0;
constexpr double kLeastSide_px = 64.0;
/// Steps along each side of an image when its outline is followed.
constexpr int kOutlineSteps = 16;
/// Cosine from the rectified axis beyond which a ray is left out.
constexpr double kLeastCosine = 0.2;

struct Extent {
  double x_min = 1e300, x_max = -1e300, y_min = 1e300, y_max = -1e300;
  void add(double x, double y) {
    x_min = std::min(x_min, x);
    x_max = std::max(x_max, x);
    y_min = std::min(y_min, y);
    y_max = std::max(y_max, y);
  }
};

/// Slopes (x / z, y / z) in the rectified frame that a view covers.
Extent extentOf(const CameraView& view, const Mat3& rectified_from_space) {
  Extent extent;
  const double w = view.model.widthPx() - 1.0, h = view.model.heightPx() - 1.0;
  for (int i = 0; i <= kOutlineSteps; ++i) {
    const double s = static_cast<double>(i) / kOutlineSteps;
    for (const Vec2& pixel : {Vec2(s * w, 0.0), Vec2(s * w, h), Vec2(0.0, s * h), Vec2(w, s * h)}) {
      const auto ray = view.direction(pixel);
      if (!ray) continue;
      const Vec3 d = rectified_from_space * *ray;
      if (d.z() > kLeastCosine) extent.add(d.x() / d.z(), d.y() / d.z());
    }
  }
  return extent;
}

}  // namespace

std::optional<RectifiedPair> RectifiedPair::make(const CameraView& a, const CameraView& b) {
  RectifiedPair pair(a, b);
  const Vec3 base = b.centre() - a.centre();
  pair.baseline_m_ = base.norm();
  if (!(pair.baseline_m_ > 0.0)) return std::nullopt;
  const Vec3 x = base / pair.baseline_m_;
  const Vec3 forward = a.camera_from_space.linear().row(2).transpose().normalized() +
                       b.camera_from_space.linear().row(2).transpose().normalized();
  const Vec3 across = forward - forward.dot(x) * x;
  if (!(across.norm() > kLeastCosine)) return std::nullopt;
  const Vec3 z = across.normalized();
  pair.rectified_from_space_.row(0) = x.transpose();
  pair.rectified_from_space_.row(1) = z.cross(x).transpose();
  pair.rectified_from_space_.row(2) = z.transpose();
  if (!pair.layOut()) return std::nullopt;
  return pair;
}

/// Chooses focal length and frames so that both images fit.
bool RectifiedPair::layOut() {
  const Extent a = extentOf(a_, rectified_from_space_), b = extentOf(b_, rectified_from_space_);
  const double top = std::max(a.y_min, b.y_min), bottom = std::min(a.y_max, b.y_max);
  if (!(bottom > top) || !(a.x_max > a.x_min) || !(b.x_max > b.x_min)) return false;
  const double widest = std::max({a.x_max - a.x_min, b.x_max - b.x_min, bottom - top});
  focal_px_ = std::min(0.5 * (a_.model.lens().fx_px + b_.model.lens().fx_px), kMaxSide_px / widest);
  x0_a_ = std::floor(focal_px_ * a.x_min);
  x0_b_ = std::floor(focal_px_ * b.x_min);
  y0_ = std::floor(focal_px_ * top);
  const auto size = [this](double extent) {
    return static_cast<int>(std::ceil(focal_px_ * extent)) + 1;
  };
  width_a_ = size(a.x_max - a.x_min);
  width_b_ = size(b.x_max - b.x_min);
  height_ = size(bottom - top);
  return std::min({width_a_, width_b_, height_}) >= kLeastSide_px;
}

cv::Mat RectifiedPair::lookUp(const CameraView& view, const cv::Mat& pixels, double x0, int width,
                              const Vec3& plane) const {
  cv::Mat map(height_, width, CV_32FC2), result;
  const Mat3 camera_from_rectified =
      view.camera_from_space.linear() * rectified_from_space_.transpose();
  for (int y = 0; y < height_; ++y) {
    auto* row = map.ptr<cv::Vec2f>(y);
    for (int x = 0; x < width; ++x) {
      const double moved = x + x0 - (plane.x() * x + plane.y() * y + plane.z());
      const auto pixel =
          view.model.project(camera_from_rectified * Vec3(moved, y + y0_, focal_px_));
      row[x] = pixel ? cv::Vec2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()))
                     : cv::Vec2f(-1e4F, -1e4F);
    }
  }
  cv::remap(pixels, result, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  return result;
}

cv::Mat RectifiedPair::imageA(const cv::Mat& pixels) const {
  return lookUp(a_, pixels, x0_a_, width_a_, Vec3::Zero());
}

cv::Mat RectifiedPair::imageB(const cv::Mat& pixels) const {
  return lookUp(b_, pixels, x0_b_, width_b_, Vec3::Zero());
}

cv::Mat RectifiedPair::imageBOverA(const cv::Mat& pixels, const Vec3& plane) const {
  return lookUp(b_, pixels, x0_b_, width_a_, plane);
}

cv::Mat RectifiedPair::maskA() const {
  const cv::Mat all(a_.model.heightPx(), a_.model.widthPx(), CV_8U, cv::Scalar(255));
  cv::Mat mask = imageA(all);
  cv::threshold(mask, mask, 254, 255, cv::THRESH_BINARY);
  return mask;
}

Vec3 RectifiedPair::disparitiesOf(const Vec3& point_m, const Vec3& normal) const {
  const Vec3 n = rectified_from_space_ * normal;
  const double distance_m = normal.dot(point_m - a_.centre());
  const Vec3 slopes = baseline_m_ / distance_m * n;
  return {slopes.x(), slopes.y(),
          slopes.x() * x0_a_ + slopes.y() * y0_ + slopes.z() * focal_px_ - disparityOffset()};
}

Vec3 RectifiedPair::point(double x, double y, double disparity) const {
  const double whole = disparity + disparityOffset();
  const double depth_m = focal_px_ * baseline_m_ / whole;
  const Vec3 at = depth_m * Vec3((x + x0_a_) / focal_px_, (y + y0_) / focal_px_, 1.0);
  return a_.centre() + rectified_from_space_.transpose() * at;
}

std::optional<Vec2> RectifiedPair::pixelA(double x, double y) const {
  return a_.model.project(a_.camera_from_space.linear() * rectified_from_space_.transpose() *
                          Vec3(x + x0_a_, y + y0_, focal_px_));
}

}  // namespace tenter
