// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>

#include "tenter/reconstruction/gray_image.h"

namespace tenter {

/// The image as OpenCV's stereo and flow want it.
inline cv::Mat eightBits(const GrayImage& image) {
  const cv::Mat pixels(image.height, image.width, CV_32FC1,
                       const_cast<float*>(image.pixels.data()));
  cv::Mat result;
  pixels.convertTo(result, CV_8U, 255.0 / static_cast<double>(image.white));
  return result;
}

}  // namespace tenter
