// SPDX-License-Identifier: GPL-3.0-or-later
#include "image_checks.h"

#include <algorithm>
#include <cmath>

namespace tenter {

namespace {

/// Share of an image at an end of its scale, and loss of sharpness, that are worth a warning.
constexpr double kSaturatedImage = 0.02, kBlurred = 0.6;

std::string percent(double share) { return std::to_string(std::lround(100.0 * share)) + " %"; }

std::string sizeOf(const GrayImage& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels";
}

}  // namespace

Result<void> checkPair(const GrayImage& reference, const GrayImage& deformed,
                       const CorrelateOptions& options) {
  if (auto ok = checkMatchOptions(options.match); !ok) return ok;
  if (reference.width != deformed.width || reference.height != deformed.height) {
    return badInput("", "",
                    "the images differ in size: " + sizeOf(reference) + " and " + sizeOf(deformed),
                    "give two images of one camera");
  }
  if (reference.white != deformed.white) {
    return badInput("", "", "one image has 8 bits and the other 16",
                    "give two images of one format");
  }
  if (std::min(reference.width, reference.height) < options.match.subset_px + 2) {
    return badInput("", "",
                    "the images are too small for a subset of " +
                        std::to_string(options.match.subset_px) + " px: " + sizeOf(reference),
                    "choose a smaller --subset");
  }
  return {};
}

Result<void> checkPoints(const GrayImage& reference, const std::vector<Vec2>& points) {
  if (points.empty()) return badInput("", "", "there are no points");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec2& p = points[i];
    if (p.x() >= 0.0 && p.y() >= 0.0 && p.x() <= reference.width - 1 &&
        p.y() <= reference.height - 1) {
      continue;
    }
    return badInput("", "point " + std::to_string(i + 1),
                    "lies outside the image of " + sizeOf(reference),
                    "x and y are in pixels, the centre of the first pixel is (0, 0)");
  }
  return {};
}

void warnOfImages(double reference_saturated, double deformed_saturated, double reference_sharpness,
                  double deformed_sharpness, std::vector<std::string>& warnings) {
  const auto ends = [&](const std::string& which, double share) {
    if (share < kSaturatedImage) return;
    warnings.push_back(percent(share) + " of " + which +
                       " is saturated, at the black or the white end");
  };
  ends("the reference", reference_saturated);
  ends("the deformed image", deformed_saturated);
  const auto blur = [&](const std::string& which, double sharpness, double other) {
    if (!(other > 0.0) || sharpness / other >= kBlurred) return;
    warnings.push_back(which +
                       " is less sharp than the other image: at equal contrast its slopes are " +
                       percent(std::sqrt(sharpness / other)) + " of the other's");
  };
  blur("the deformed image", deformed_sharpness, reference_sharpness);
  blur("the reference", reference_sharpness, deformed_sharpness);
}

}  // namespace tenter
