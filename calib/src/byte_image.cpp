// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/byte_image.h"

#include <zlib.h>

#include <cmath>
#include <cstring>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tenter/core/files.h"

namespace tenter {

namespace {

constexpr std::size_t kLimit_bytes = std::size_t{1} << 29;
constexpr int kMinSide_px = 8, kMaxSide_px = 32768;

void silenceOpenCv() {
  // Its loaders print about files that they cannot read; the reason is told by an Error.
  static const bool kOnce = [] {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    return true;
  }();
  (void)kOnce;
}

cv::Mat scaledToBytes(const cv::Mat& image) {
  if (image.depth() == CV_8U) return image;
  double brightest = 0.0;
  cv::minMaxLoc(image, nullptr, &brightest);
  cv::Mat bytes;
  image.convertTo(bytes, CV_8U, brightest > 0.0 ? 255.0 / brightest : 1.0);
  return bytes;
}

std::string bigEndian(std::uint32_t value) {
  std::string bytes(4, '\0');
  for (int i = 0; i < 4; ++i) bytes[i] = static_cast<char>(value >> (24 - 8 * i));
  return bytes;
}

/// A chunk of a PNG: length, type, data, CRC-32 of type and data.
std::string chunk(const std::string& type, const std::string& data) {
  const std::string body = type + data;
  const auto crc =
      ::crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  return bigEndian(static_cast<std::uint32_t>(data.size())) + body +
         bigEndian(static_cast<std::uint32_t>(crc));
}

}  // namespace

Result<ByteImage> decodeByteImage(std::string_view bytes, const std::string& file) {
  silenceOpenCv();
  const auto noImage = [&] {
    return badInput(file, "", "is not an image that can be read", "PNG, TIFF and JPEG are");
  };
  if (bytes.empty() || bytes.size() > kLimit_bytes) return noImage();
  cv::Mat image;
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U,
                         const_cast<char*>(bytes.data()));  // NOLINT: imdecode only reads
    image = cv::imdecode(
        buffer, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
    if (image.empty() || image.channels() != 1) return noImage();
    const int shorter = std::min(image.cols, image.rows), longer = std::max(image.cols, image.rows);
    if (shorter < kMinSide_px || longer > kMaxSide_px) {
      return badInput(file, "",
                      "is " + std::to_string(image.cols) + " x " + std::to_string(image.rows) +
                          " pixels; 8 to 32768 a side can be read");
    }
    image = scaledToBytes(image);
  } catch (const cv::Exception&) {
    return noImage();
  }
  ByteImage out{image.cols, image.rows, {}};
  out.pixels.resize(static_cast<std::size_t>(image.cols) * image.rows);
  for (int y = 0; y < image.rows; ++y) {
    std::memcpy(out.pixels.data() + static_cast<std::size_t>(y) * image.cols, image.ptr(y),
                image.cols);
  }
  return out;
}

Result<ByteImage> readByteImage(const std::filesystem::path& file) {
  const auto bytes = readFile(file, kLimit_bytes);
  if (!bytes) return bytes.error();
  return decodeByteImage(*bytes, file.string());
}

std::string encodePng(const ByteImage& image, double pixels_per_m) {
  require(image.width > 0 && image.height > 0 &&
              image.pixels.size() == static_cast<std::size_t>(image.width) * image.height,
          "encodePng takes a whole image");
  const cv::Mat view(image.height, image.width, CV_8U,
                     const_cast<std::uint8_t*>(image.pixels.data()));
  std::vector<unsigned char> encoded;
  require(cv::imencode(".png", view, encoded), "OpenCV encodes PNG");
  // The physical size goes right behind the header: 8 bytes of signature, 25 of the first chunk.
  constexpr std::size_t kBehindHeader = 33;
  const auto density = bigEndian(static_cast<std::uint32_t>(std::lround(pixels_per_m)));
  std::string bytes(encoded.begin(), encoded.end());
  const std::string maker = std::string("Software") + '\0' + "Tenter";
  bytes.insert(kBehindHeader, chunk("pHYs", density + density + '\1') + chunk("tEXt", maker));
  return bytes;
}

}  // namespace tenter
