// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// A grey image of bytes, rows from the top: what boards are looked for in, and what is printed.
struct ByteImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;  ///< height x width, 0 black to 255 white.

  std::uint8_t at(int x, int y) const { return pixels[static_cast<std::size_t>(y) * width + x]; }
};

/// Reads PNG, TIFF, JPEG, BMP, PGM ... of any depth; colour becomes luminance, 16-bit values are
/// scaled so that the brightest becomes 255. An orientation in the file's EXIF data is not obeyed:
/// calibration belongs to the sensor's pixels. Error for what is no image or has a side below 8
/// or above 32768 px.
Result<ByteImage> readByteImage(const std::filesystem::path& file);
Result<ByteImage> decodeByteImage(std::string_view bytes, const std::string& file);

/// The bytes of a PNG that says how large its pixels are, so that it prints at true scale.
std::string encodePng(const ByteImage& image, double pixels_per_m);

}  // namespace tenter
