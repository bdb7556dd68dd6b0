// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tenter/calib/print_page.h"

namespace tenter {

namespace {

/// How much of pixel i lies between two places, 0 to 1.
double covered(int i, double from, double to) {
  return std::clamp(std::min(to, i + 1.0) - std::max(from, static_cast<double>(i)), 0.0, 1.0);
}

void drawBox(cv::Mat& canvas, const PrintPage::Box& box, double scale) {
  const double left = scale * box.x_mm, right = left + scale * box.width_mm;
  const double top = scale * box.y_mm, bottom = top + scale * box.height_mm;
  const int x_end = std::min(canvas.cols, static_cast<int>(std::ceil(right)));
  const int y_end = std::min(canvas.rows, static_cast<int>(std::ceil(bottom)));
  for (int y = std::max(0, static_cast<int>(top)); y < y_end; ++y) {
    const double part_y = covered(y, top, bottom);
    auto* row = canvas.ptr<float>(y);
    for (int x = std::max(0, static_cast<int>(left)); x < x_end; ++x) {
      const double part = part_y * covered(x, left, right);
      row[x] += static_cast<float>(part * (box.grey - static_cast<double>(row[x])));
    }
  }
}

void drawPicture(cv::Mat& canvas, const PrintPage::Picture& picture, double scale) {
  const cv::Mat image(picture.image.height, picture.image.width, CV_8U,
                      const_cast<std::uint8_t*>(picture.image.pixels.data()));
  const double size_x = scale * picture.width_mm / image.cols;
  const double size_y = scale * picture.height_mm / image.rows;
  // Centres of pixels: those of the picture lie half a pixel of theirs inside its rim.
  const cv::Matx23d canvas_from_picture(size_x, 0.0, scale * picture.x_mm + 0.5 * size_x - 0.5, 0.0,
                                        size_y, scale * picture.y_mm + 0.5 * size_y - 0.5);
  cv::Mat source;
  image.convertTo(source, CV_32F);
  cv::warpAffine(source, canvas, canvas_from_picture, canvas.size(), cv::INTER_LINEAR,
                 cv::BORDER_TRANSPARENT);
}

void drawText(cv::Mat& canvas, const PrintPage::Text& line, double scale) {
  constexpr double kCapital_px = 21.0;  // of OpenCV's simplex font at scale one
  const double size = scale * line.height_mm / kCapital_px;
  const cv::Point at(static_cast<int>(std::lround(scale * line.x_mm)),
                     static_cast<int>(std::lround(scale * line.y_mm)));
  const int thickness = std::max(1, static_cast<int>(std::lround(2.0 * size)));
  cv::putText(canvas, line.text, at, cv::FONT_HERSHEY_SIMPLEX, size, cv::Scalar(0.0), thickness,
              cv::LINE_8);
}

}  // namespace

Result<ByteImage> rasterOf(const PrintPage& page, double pixels_per_mm) {
  constexpr double kMostPixels = 1 << 28;
  const double width = std::round(page.width_mm * pixels_per_mm);
  const double height = std::round(page.height_mm * pixels_per_mm);
  if (!(width >= 1.0 && height >= 1.0 && width * height <= kMostPixels)) {
    return usageError("the image would be too large or empty", "choose fewer dots per inch");
  }
  cv::Mat canvas(static_cast<int>(height), static_cast<int>(width), CV_32F, cv::Scalar(255.0));
  if (page.picture.image.width > 0) drawPicture(canvas, page.picture, pixels_per_mm);
  for (const PrintPage::Box& box : page.boxes) drawBox(canvas, box, pixels_per_mm);
  for (const PrintPage::Text& line : page.texts) drawText(canvas, line, pixels_per_mm);
  cv::Mat bytes;
  canvas.convertTo(bytes, CV_8U);
  ByteImage out{canvas.cols, canvas.rows, {}};
  out.pixels.assign(bytes.datastart, bytes.dataend);
  return out;
}

}  // namespace tenter
