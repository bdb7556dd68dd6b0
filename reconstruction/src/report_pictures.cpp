// SPDX-License-Identifier: GPL-3.0-or-later
#include "report_pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "eight_bits.h"

namespace tenter {

namespace {

constexpr int kMapSide_px = 320, kOverlayWidth_px = 900;
constexpr double kCurveWidth = 640.0, kCurveHeight = 120.0;

std::string base64(const std::vector<unsigned char>& bytes) {
  constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < left ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= left ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

std::string imageTag(const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  cv::imencode(".png", image, bytes);
  return "<img src=\"data:image/png;base64," + base64(bytes) + "\" alt=\"\">";
}

}  // namespace

std::string htmlText(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '&':
        safe += "&amp;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string mapPicture(const RestSurface& rest, const std::vector<double>& values, double low,
                       double high) {
  cv::Mat levels = cv::Mat::zeros(rest.rows, rest.columns, CV_8U);
  cv::Mat known = cv::Mat::zeros(rest.rows, rest.columns, CV_8U);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    const int node = rest.node_of_vertex[i];
    // Rows of the grid go up, rows of a picture down.
    const int row = rest.rows - 1 - node / rest.columns, column = node % rest.columns;
    const double share = high > low ? (values[i] - low) / (high - low) : 0.0;
    levels.at<uchar>(row, column) = cv::saturate_cast<uchar>(255.0 * std::clamp(share, 0.0, 1.0));
    known.at<uchar>(row, column) = 255;
  }
  cv::Mat colours;
  cv::applyColorMap(levels, colours, cv::COLORMAP_CIVIDIS);
  colours.setTo(cv::Scalar(160, 160, 160), known == 0);
  const double scale = static_cast<double>(kMapSide_px) / std::max(rest.columns, rest.rows);
  cv::resize(colours, colours, cv::Size(), scale, scale, cv::INTER_NEAREST);
  return imageTag(colours);
}

std::string overlayPicture(const GrayImage& image, const CameraView& view,
                           const MeasurementFrame& frame) {
  cv::Mat picture;
  cv::cvtColor(eightBits(image), picture, cv::COLOR_GRAY2BGR);
  const double scale = std::min(1.0, static_cast<double>(kOverlayWidth_px) / image.width);
  cv::resize(picture, picture, cv::Size(), scale, scale, cv::INTER_AREA);
  for (Eigen::Index i = 0; i < frame.positions.cols(); ++i) {
    const auto pixel = view.project(frame.positions.col(i));
    if (!pixel || !view.model.contains(*pixel)) continue;
    const cv::Point at(static_cast<int>(scale * pixel->x()), static_cast<int>(scale * pixel->y()));
    const bool valid = frame.valid[static_cast<std::size_t>(i)] != 0;
    cv::circle(picture, at, 1, valid ? cv::Scalar(80, 200, 80) : cv::Scalar(60, 60, 230),
               cv::FILLED);
  }
  return imageTag(picture);
}

std::string curvePicture(const std::string& title, const std::vector<double>& values) {
  const double most = values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
  std::string points;
  char text[160];
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double x = values.size() > 1 ? kCurveWidth * static_cast<double>(i) /
                                             (static_cast<double>(values.size()) - 1.0)
                                       : 0.5 * kCurveWidth;
    const double y = kCurveHeight * (1.0 - (most > 0.0 ? values[i] / most : 0.0));
    std::snprintf(text, sizeof text, "%.1f,%.1f ", x, y);
    points += text;
  }
  std::snprintf(text, sizeof text, "<svg viewBox=\"-4 -4 %.0f %.0f\" width=\"%.0f\">",
                kCurveWidth + 8.0, kCurveHeight + 8.0, kCurveWidth);
  std::string svg = text;
  std::snprintf(text, sizeof text, "%.4g", most);
  return "<figure>" + svg + "<rect width=\"640\" height=\"120\" fill=\"none\" stroke=\"#999\"/>" +
         "<polyline fill=\"none\" stroke=\"#1f5fa8\" stroke-width=\"1.5\" points=\"" + points +
         "\"/></svg><figcaption>" + htmlText(title) + ", 0 to " + text + "</figcaption></figure>";
}

}  // namespace tenter
