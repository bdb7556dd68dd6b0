// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/image_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "random_numbers.h"
#include "tenter/core/files.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;

constexpr double kPictureNoise_rms = 1.0;
constexpr std::size_t kMostPictures = 100'000;

bool isPicture(const fs::path& file) {
  static const std::array<std::string, 7> kExtensions{".png",  ".tif", ".tiff", ".jpg",
                                                      ".jpeg", ".bmp", ".pgm"};
  return std::find(kExtensions.begin(), kExtensions.end(), file.extension()) != kExtensions.end();
}

/// Quick, and good enough for dots and noise.
std::uint64_t mixed(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15ULL;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ULL;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebULL;
  return value ^ (value >> 31);
}

std::uint8_t clipped(double value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
}

}  // namespace

void expose(std::span<std::uint8_t> pixels, double exposure_us, double gain_dB) {
  const double factor = exposure_us / kNominalExposure_us * std::pow(10.0, gain_dB / 20.0);
  if (std::abs(factor - 1.0) < 1e-6) return;
  std::array<std::uint8_t, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    table[i] = clipped(factor * static_cast<double>(i));
  }
  for (std::uint8_t& pixel : pixels) pixel = table[pixel];
}

void addSensorNoise(std::span<std::uint8_t> pixels, double rms, std::uint64_t seed) {
  // Numbers drawn once, and read from another place in every stretch of pixels.
  constexpr std::size_t kTable = 1U << 16, kStretch = 1021;
  static const std::vector<float> kNormal = [] {
    RandomNumbers random(1, "sensor noise");
    std::vector<float> numbers(kTable + kStretch);
    for (float& number : numbers) number = static_cast<float>(random.normal());
    return numbers;
  }();
  const auto scale = static_cast<float>(rms);
  for (std::size_t begin = 0; begin < pixels.size(); begin += kStretch) {
    seed = mixed(seed);
    const float* noise = kNormal.data() + seed % kTable;
    const std::size_t end = std::min(begin + kStretch, pixels.size());
    for (std::size_t i = begin; i < end; ++i) {
      const float value = static_cast<float>(pixels[i]) + scale * noise[i - begin] + 0.5F;
      pixels[i] = static_cast<std::uint8_t>(std::clamp(value, 0.0F, 255.0F));
    }
  }
}

Result<std::shared_ptr<PictureSource>> PictureSource::open(const fs::path& path,
                                                           std::uint64_t seed) {
  std::shared_ptr<PictureSource> source(new PictureSource);
  source->seed_ = seed;
  std::error_code failed;
  if (fs::is_directory(path, failed)) {
    for (const auto& entry : fs::directory_iterator(path, failed)) {
      if (isPicture(entry.path())) source->pictures_.push_back(entry.path());
      if (source->pictures_.size() > kMostPictures) break;
    }
    std::sort(source->pictures_.begin(), source->pictures_.end());
  } else {
    source->pictures_.push_back(path);
  }
  if (failed) return badInput(path.string(), "", failed.message());
  if (source->pictures_.empty()) return badInput(path.string(), "", "holds no picture");
  for (const fs::path& file : source->pictures_) {
    const cv::Mat picture = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
    if (picture.empty()) return badInput(file.string(), "", "cannot be read as a picture");
    if (source->width_px_ == 0) {
      source->width_px_ = picture.cols;
      source->height_px_ = picture.rows;
    }
    if (picture.cols != source->width_px_ || picture.rows != source->height_px_) {
      return badInput(file.string(), "", "is of another size than the pictures before it");
    }
  }
  return source;
}

const fs::path& PictureSource::pictureOf(const ImageRequest& request) const {
  std::vector<const fs::path*> own;
  for (const fs::path& file : pictures_) {
    if (file.stem().string().find(request.camera_name) != std::string::npos) own.push_back(&file);
  }
  if (!own.empty()) return *own[request.frame % own.size()];
  return pictures_[request.frame % pictures_.size()];
}

void PictureSource::fill(const ImageRequest& request, std::span<std::uint8_t> pixels) {
  cv::Mat picture = cv::imread(pictureOf(request).string(), cv::IMREAD_GRAYSCALE);
  std::fill(pixels.begin(), pixels.end(), std::uint8_t{0});
  const int rows = std::min(picture.rows, request.height_px);
  const int columns = std::min(picture.cols, request.width_px);
  for (int row = 0; row < rows; ++row) {
    const std::uint8_t* from = picture.ptr<std::uint8_t>(row);
    std::copy(from, from + columns,
              pixels.data() + static_cast<std::ptrdiff_t>(row) * request.width_px);
  }
  expose(pixels, request.exposure_us, request.gain_dB);
  addSensorNoise(
      pixels, kPictureNoise_rms,
      mixed(seed_ ^ mixed(static_cast<std::uint64_t>(request.camera) << 40 ^ request.frame)));
}

}  // namespace tenter
