// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// What a virtual camera asks for when it is triggered.
struct ImageRequest {
  int camera = 0;  ///< From 0.
  std::string camera_name;
  std::uint64_t frame = 0;  ///< Of this camera, from 0 since it was plugged in.
  int width_px = 0, height_px = 0;
  double exposure_us = 0.0, gain_dB = 0.0;
};

/// Where the images of virtual cameras come from.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  /// Fills `pixels`, width x height, row by row, 8 bits each. From each camera's thread, several at
  /// once; while it lasts the camera answers nobody, so within a second.
  virtual void fill(const ImageRequest& request, std::span<std::uint8_t> pixels) = 0;
};

/// Light that falls on a pixel in an exposure of so long gives a value as it is in the picture.
inline constexpr double kNominalExposure_us = 5000.0;
/// Scales values for another exposure and gain; what is beyond the scale is cut off.
void expose(std::span<std::uint8_t> pixels, double exposure_us, double gain_dB);
/// Adds noise of so many grey values RMS, the same for the same seed.
void addSensorNoise(std::span<std::uint8_t> pixels, double rms, std::uint64_t seed);

/// Random dots, others in each frame, that begin with the camera and the frame they are of; a torn
/// or mixed-up image can thus be told. Exposure does not change it.
class TestPatternSource : public ImageSource {
 public:
  void fill(const ImageRequest& request, std::span<std::uint8_t> pixels) override;
};
struct TestPatternMark {
  int camera = 0;
  std::uint64_t frame = 0;
};
/// Nothing if the image is no test pattern, or is not all of one.
std::optional<TestPatternMark> readTestPattern(std::span<const std::uint8_t> pixels);

/// One picture, or a folder of them: those with the camera's name in theirs if there are any, else
/// all of them; in the order of their names, and from the beginning again. With exposure and noise.
class PictureSource : public ImageSource {
 public:
  /// Error: no picture there, or two of different sizes.
  static Result<std::shared_ptr<PictureSource>> open(const std::filesystem::path& path,
                                                     std::uint64_t seed);
  void fill(const ImageRequest& request, std::span<std::uint8_t> pixels) override;
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }

 private:
  PictureSource() = default;
  const std::filesystem::path& pictureOf(const ImageRequest& request) const;

  std::vector<std::filesystem::path> pictures_;
  int width_px_ = 0, height_px_ = 0;
  std::uint64_t seed_ = 0;
};

}  // namespace tenter
