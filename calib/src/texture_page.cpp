// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "page_layout.h"
#include "tenter/calib/wavelet_noise.h"

namespace tenter {

namespace {

/// Each band weighs less than the next finer one, so that the finest dots keep their contrast.
constexpr double kCoarserWeight = 0.7;

int evenSamples(double length_mm, double sample_mm) {
  return std::max(4, 2 * static_cast<int>(std::ceil(0.5 * length_mm / sample_mm)));
}

Result<void> check(const TextureOptions& o) {
  constexpr double kMostSamples = 1 << 24, kMostPixels = 1 << 28;
  if (!(o.width_mm >= 5.0 && o.width_mm <= 3000.0 && o.height_mm >= 5.0 && o.height_mm <= 3000.0)) {
    return usageError("the texture must be 5 to 3000 mm wide and high");
  }
  if (!(o.feature_mm >= 0.02 && o.feature_mm <= 0.1 * std::min(o.width_mm, o.height_mm))) {
    return usageError("--feature-mm must lie between 0.02 and a tenth of the texture");
  }
  if (o.bands < 1 || o.bands > 8) return usageError("--bands must be 1 to 8");
  if (!(o.dots_per_inch >= 50.0 && o.dots_per_inch <= 4800.0)) {
    return usageError("--dpi must be 50 to 4800");
  }
  const double area = o.width_mm * o.height_mm, dots = o.dots_per_inch / 25.4;
  if (area / (o.feature_mm * o.feature_mm) > kMostSamples || area * dots * dots > kMostPixels) {
    return usageError("the texture would be too large", "fewer dots per inch, or coarser features");
  }
  return {};
}

/// Sum of the bands on a grid of pixels, row by row, and its standard deviation.
std::vector<float> bandsOn(const TextureOptions& o, int width, int height, double& deviation) {
  std::vector<float> values(static_cast<std::size_t>(width) * height, 0.0F);
  double weight = 1.0, sample_mm = o.feature_mm;
  for (int band = 0; band < o.bands; ++band, weight *= kCoarserWeight, sample_mm *= 2.0) {
    const WaveletNoiseBand noise(evenSamples(o.width_mm, sample_mm),
                                 evenSamples(o.height_mm, sample_mm),
                                 o.seed * 8U + static_cast<unsigned>(band));
    const double step_x = o.width_mm / width / sample_mm, step_y = o.height_mm / height / sample_mm;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        values[static_cast<std::size_t>(y) * width + x] +=
            static_cast<float>(weight * noise.at((x + 0.5) * step_x, (y + 0.5) * step_y));
      }
    }
  }
  double squares = 0.0;
  for (const float value : values) squares += static_cast<double>(value) * value;
  deviation = std::sqrt(squares / static_cast<double>(values.size()));
  return values;
}

}  // namespace

Result<PrintPage> texturePage(const TextureOptions& o, const Paper& paper) {
  if (auto ok = check(o); !ok) return ok.error();
  char caption[160];
  std::snprintf(
      caption, sizeof caption,
      "Wavelet noise, %.4g mm, %d bands, seed %u. Print at 100 %%, then measure the rulers.",
      o.feature_mm, o.bands, o.seed);
  auto layout = layOut(o.width_mm, o.height_mm, paper, caption);
  if (!layout) return layout.error();
  const int width = static_cast<int>(std::lround(o.width_mm * o.dots_per_inch / 25.4));
  const int height = static_cast<int>(std::lround(o.height_mm * o.dots_per_inch / 25.4));
  double deviation = 0.0;
  const std::vector<float> values = bandsOn(o, width, height, deviation);
  PrintPage::Picture picture{layout->x_mm, layout->y_mm, o.width_mm, o.height_mm,
                             ByteImage{width, height, {}}};
  picture.image.pixels.reserve(values.size());
  for (const float value : values) {
    // The normal distribution's own integral spreads the greys evenly from black to white.
    const double level = 0.5 * std::erfc(-value / deviation / std::numbers::sqrt2);
    picture.image.pixels.push_back(static_cast<std::uint8_t>(std::lround(255.0 * level)));
  }
  layout->page.picture = std::move(picture);
  return std::move(layout->page);
}

}  // namespace tenter
