// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/acquisition/frame_quality.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace tenter {
namespace {

/// A view on the pixels; they are not copied, and nobody writes through it.
cv::Mat matOf(const CameraImage& image) {
  return {image.height_px, image.width_px, image.bits > 8 ? CV_16UC1 : CV_8UC1,
          const_cast<std::uint8_t*>(image.pixels.data())};
}

double meanSquare(const cv::Mat& values) {
  const double norm = cv::norm(values, cv::NORM_L2);
  return norm * norm / static_cast<double>(values.total());
}

}  // namespace

FrameQuality frameQuality(const CameraImage& image) {
  FrameQuality quality;
  if (image.pixels.empty() || image.width_px < 4 || image.height_px < 4) return quality;
  const cv::Mat pixels = matOf(image);
  const double scale = (1 << image.bits) - 1;
  quality.saturated_share = cv::countNonZero(pixels >= scale) / static_cast<double>(pixels.total());
  cv::Mat half;
  cv::resize(pixels, half, {image.width_px / 2, image.height_px / 2}, 0, 0, cv::INTER_AREA);
  half.convertTo(half, CV_32F, 1.0 / scale);
  cv::Scalar mean, deviation;
  cv::meanStdDev(half, mean, deviation);
  quality.mean = mean[0];
  const double variance = deviation[0] * deviation[0];
  if (variance <= 0.0) return quality;
  const cv::Mat across = half.colRange(1, half.cols) - half.colRange(0, half.cols - 1);
  const cv::Mat down = half.rowRange(1, half.rows) - half.rowRange(0, half.rows - 1);
  quality.sharpness = (meanSquare(across) + meanSquare(down)) / variance;
  return quality;
}

Result<std::string> encodePng(const CameraImage& image) {
  constexpr int kFast = 1;  // noise hardly shrinks any further, and ten times the time is lost
  std::vector<std::uint8_t> bytes;
  try {
    if (cv::imencode(".png", matOf(image), bytes, {cv::IMWRITE_PNG_COMPRESSION, kFast})) {
      return std::string(bytes.begin(), bytes.end());
    }
  } catch (const cv::Exception& error) {
    return badInput("", "image", error.what());
  }
  return badInput("", "image", "cannot be coded as PNG");
}

}  // namespace tenter
