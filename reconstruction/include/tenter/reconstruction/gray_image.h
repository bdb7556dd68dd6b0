// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// A grey image, rows from the top; the centre of the first pixel is (0, 0).
struct GrayImage {
  int width = 0, height = 0;
  float white = 255.0F;       ///< Greatest value that its format holds: 255 or 65535.
  std::vector<float> pixels;  ///< height x width, [grey levels] from 0 to white.

  GrayImage() = default;
  GrayImage(int columns, int rows, float white_level = 255.0F);
  float at(int x, int y) const { return pixels[static_cast<std::size_t>(y) * width + x]; }
  float& at(int x, int y) { return pixels[static_cast<std::size_t>(y) * width + x]; }
};

/// An image as it was read, and what a person should know about it.
struct ImageFile {
  GrayImage image;
  std::vector<std::string> warnings;  ///< Such as "colour was turned into grey".
};

/// Reads TIFF, PNG, JPEG, BMP, PGM and what else OpenCV decodes, 8 or 16 bits a channel. Colour
/// becomes luminance (Rec. 601) and an alpha channel is left out, each with a warning. Error if the
/// file is missing, no image, not 8 or 16 bits deep, smaller than 8 or larger than 16384 pixels a
/// side.
Result<ImageFile> readGrayImage(const std::filesystem::path& file);

/// The same of the bytes of a file; `file` is its name in errors.
Result<ImageFile> decodeGrayImage(std::string_view bytes, const std::string& file);

}  // namespace tenter
