// SPDX-License-Identifier: GPL-3.0-or-later
#include "pattern.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tenter/calib/print_page.h"
#include "tenter/calib/wavelet_noise.h"

namespace tenter {
namespace {

constexpr double kMmPerMetre = 1e3;
constexpr double kSameLine_mm = 1e-6;
constexpr int kBands = 3;
constexpr double kCoarserWeight = 0.7;  // as `tenter pattern texture` prints it
constexpr double kStepsAFeature = 4.0;  // between them the pattern is linear
constexpr double kDarkestDye = 0.10, kPlainCloth = 0.75;

/// Sorted, each once.
std::vector<double> distinct(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto same = [](double a, double b) { return b - a < kSameLine_mm; };
  values.erase(std::unique(values.begin(), values.end(), same), values.end());
  return values;
}

int placeOf(const std::vector<double>& lines, double value) {
  return static_cast<int>(std::lower_bound(lines.begin(), lines.end(), value - kSameLine_mm) -
                          lines.begin());
}

/// Cell that holds a place, -1 before the first line, and as many as cells behind the last.
int cellOf(const std::vector<double>& lines, double value) {
  return static_cast<int>(std::upper_bound(lines.begin(), lines.end(), value) - lines.begin()) - 1;
}

/// Length of [low, high] in a cell.
double overlap(const std::vector<double>& lines, int cell, double low, double high) {
  const double from = cell < 0 ? low : std::max(low, lines[static_cast<std::size_t>(cell)]);
  const auto next = static_cast<std::size_t>(cell + 1);
  const double to = next >= lines.size() ? high : std::min(high, lines[next]);
  return std::max(0.0, to - from);
}

}  // namespace

CellPattern::CellPattern(const ByteImage& cells, double size_m) {
  for (int i = 0; i <= cells.width; ++i) x_lines_.push_back(size_m * (1.0 * i / cells.width - 0.5));
  for (int i = 0; i <= cells.height; ++i)
    y_lines_.push_back(size_m * (1.0 * i / cells.height - 0.5));
  for (const std::uint8_t value : cells.pixels) white_.push_back(value > 127);
}

CellPattern::CellPattern(const Board& board) {
  const auto page = boardPage(board, *paperByName("fit"));
  require(page.ok(), "CellPattern takes a valid board");
  // The first square is black and begins with the first lines; rulers come before it.
  const double square_mm = kMmPerMetre * board.square_m;
  const auto first =
      std::find_if(page->boxes.begin(), page->boxes.end(), [&](const PrintPage::Box& box) {
        return box.width_mm == square_mm && box.height_mm == square_mm;
      });
  const std::vector<PrintPage::Box> boxes(first, page->boxes.end());
  std::vector<double> x, y;
  for (const PrintPage::Box& box : boxes) {
    x.insert(x.end(), {box.x_mm, box.x_mm + box.width_mm});
    y.insert(y.end(), {box.y_mm, box.y_mm + box.height_mm});
  }
  x = distinct(std::move(x));
  y = distinct(std::move(y));
  const std::size_t columns = x.size() - 1, rows = y.size() - 1;
  white_.assign(columns * rows, true);
  for (const PrintPage::Box& box : boxes) {
    const int right = placeOf(x, box.x_mm + box.width_mm);
    const int bottom = placeOf(y, box.y_mm + box.height_mm);
    for (int row = placeOf(y, box.y_mm); row < bottom; ++row) {
      for (int column = placeOf(x, box.x_mm); column < right; ++column) {
        white_[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)] =
            box.grey > 127;
      }
    }
  }
  for (const double line : x) x_lines_.push_back((line - x.front() - square_mm) / kMmPerMetre);
  for (const double line : y) y_lines_.push_back((line - y.front() - square_mm) / kMmPerMetre);
}

bool CellPattern::white(int column, int row) const {
  const int columns = static_cast<int>(x_lines_.size()) - 1;
  const int rows = static_cast<int>(y_lines_.size()) - 1;
  if (column < 0 || column >= columns || row < 0 || row >= rows) return true;
  return white_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                static_cast<std::size_t>(column)];
}

double CellPattern::albedo(double x, double y, double size_m) const {
  const double left = x - 0.5 * size_m, right = x + 0.5 * size_m;
  const double top = y - 0.5 * size_m, bottom = y + 0.5 * size_m;
  const int last_column = cellOf(x_lines_, right), last_row = cellOf(y_lines_, bottom);
  double light = 0.0;
  for (int row = cellOf(y_lines_, top); row <= last_row; ++row) {
    const double height = overlap(y_lines_, row, top, bottom);
    for (int column = cellOf(x_lines_, left); column <= last_column; ++column) {
      if (white(column, row)) light += height * overlap(x_lines_, column, left, right);
    }
  }
  return kBlackAlbedo + (kWhiteAlbedo - kBlackAlbedo) * light / (size_m * size_m);
}

NoisePattern::NoisePattern(double reach_m, double feature_m, unsigned seed)
    : side_(static_cast<int>(std::ceil(reach_m / feature_m * kStepsAFeature)) + 2),
      step_m_(feature_m / kStepsAFeature) {
  albedo_.assign(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_), 0.0F);
  double weight = 1.0, feature = kStepsAFeature;  // in steps
  for (int band = 0; band < kBands; ++band, weight *= kCoarserWeight, feature *= 2.0) {
    const int samples = 2 * static_cast<int>(std::ceil(0.5 * side_ / feature)) + 4;
    const WaveletNoiseBand noise(samples, samples, seed * 8U + static_cast<unsigned>(band));
    for (int y = 0; y < side_; ++y) {
      for (int x = 0; x < side_; ++x) {
        albedo_[static_cast<std::size_t>(y) * static_cast<std::size_t>(side_) +
                static_cast<std::size_t>(x)] +=
            static_cast<float>(weight * noise.at(x / feature, y / feature));
      }
    }
  }
  double squares = 0.0;
  for (const float value : albedo_) squares += static_cast<double>(value) * value;
  const double deviation = std::sqrt(squares / static_cast<double>(albedo_.size()));
  for (float& value : albedo_) {
    // The normal distribution's own integral spreads the greys evenly.
    const double level = 0.5 * std::erfc(-value / deviation / std::numbers::sqrt2);
    value = static_cast<float>(kDarkestDye + (kPlainCloth - kDarkestDye) * level);
  }
}

double NoisePattern::albedo(double x, double y, double /*size_m*/) const {
  const double column = std::clamp(x / step_m_, 0.0, side_ - 1.001);
  const double row = std::clamp(y / step_m_, 0.0, side_ - 1.001);
  const int i = static_cast<int>(column), j = static_cast<int>(row);
  const auto s = static_cast<float>(column - i), t = static_cast<float>(row - j);
  const float* at = &albedo_[static_cast<std::size_t>(j) * static_cast<std::size_t>(side_) +
                             static_cast<std::size_t>(i)];
  const float upper = at[0] + s * (at[1] - at[0]);
  const float lower = at[side_] + s * (at[side_ + 1] - at[side_]);
  return upper + t * (lower - upper);
}

}  // namespace tenter
