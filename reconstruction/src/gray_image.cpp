// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/gray_image.h"

#include <iostream>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "tenter/core/files.h"

namespace tenter {

namespace {

constexpr std::size_t kLimit_bytes = std::size_t{1} << 30;
constexpr int kSmallest_px = 8, kLargest_px = 16384;

/// Keeps OpenCV from printing while a file is decoded: it writes to std::cerr and to its own log.
class Silence {
 public:
  Silence()
      : level_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)),
        buffer_(std::cerr.rdbuf(sink_.rdbuf())) {}
  ~Silence() {
    std::cerr.rdbuf(buffer_);
    cv::utils::logging::setLogLevel(level_);
  }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  cv::utils::logging::LogLevel level_;
  std::ostringstream sink_;
  std::streambuf* buffer_;
};

/// The decoded file; empty if OpenCV does not make an image of it.
cv::Mat decode(std::string_view bytes) {
  const Silence silence;
  try {
    // OpenCV takes the bytes as not const and leaves them alone.
    auto* data = reinterpret_cast<uchar*>(const_cast<char*>(bytes.data()));
    const cv::Mat input(1, static_cast<int>(bytes.size()), CV_8UC1, data);
    return cv::imdecode(input, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    return {};
  }
}

Result<void> checkFormat(const cv::Mat& decoded, const std::string& file) {
  if (decoded.empty()) {
    return badInput(file, "", "is no image that can be decoded",
                    "give a TIFF, PNG, JPEG, BMP or PGM file");
  }
  if (decoded.depth() != CV_8U && decoded.depth() != CV_16U) {
    return badInput(file, "", "holds other than 8 or 16 bits a channel",
                    "convert it to 8 or 16 bits of grey");
  }
  const int channels = decoded.channels();
  if (channels != 1 && channels != 3 && channels != 4) {
    return badInput(file, "", "has " + std::to_string(channels) + " channels",
                    "convert it to grey");
  }
  for (const int side : {decoded.cols, decoded.rows}) {
    if (side >= kSmallest_px && side <= kLargest_px) continue;
    return badInput(file, "",
                    "is " + std::to_string(decoded.cols) + " x " + std::to_string(decoded.rows) +
                        " pixels; " + std::to_string(kSmallest_px) + " to " +
                        std::to_string(kLargest_px) + " a side can be used");
  }
  return {};
}

/// One channel out of colour or grey with alpha.
cv::Mat toGray(const cv::Mat& decoded, std::vector<std::string>& warnings) {
  if (decoded.channels() == 1) return decoded;
  cv::Mat gray;
  const bool alpha = decoded.channels() == 4;
  cv::cvtColor(decoded, gray, alpha ? cv::COLOR_BGRA2GRAY : cv::COLOR_BGR2GRAY);
  warnings.emplace_back(alpha ? "colour was turned into grey, transparency was left out"
                              : "colour was turned into grey");
  return gray;
}

}  // namespace

GrayImage::GrayImage(int columns, int rows, float white_level)
    : width(columns), height(rows), white(white_level) {
  require(columns >= 0 && rows >= 0, "an image has no negative size");
  pixels.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
}

Result<ImageFile> decodeGrayImage(std::string_view bytes, const std::string& file) {
  if (bytes.empty()) return badInput(file, "", "is empty");
  if (bytes.size() > kLimit_bytes) return badInput(file, "", "is larger than 1 GiB");
  const cv::Mat decoded = decode(bytes);
  if (auto ok = checkFormat(decoded, file); !ok) return ok.error();
  ImageFile result;
  const cv::Mat gray = toGray(decoded, result.warnings);
  result.image = GrayImage(gray.cols, gray.rows, gray.depth() == CV_8U ? 255.0F : 65535.0F);
  cv::Mat target(gray.rows, gray.cols, CV_32FC1, result.image.pixels.data());
  gray.convertTo(target, CV_32F);
  return result;
}

Result<ImageFile> readGrayImage(const std::filesystem::path& file) {
  const auto bytes = readFile(file, kLimit_bytes);
  if (!bytes) return bytes.error();
  return decodeGrayImage(*bytes, file.string());
}

}  // namespace tenter
