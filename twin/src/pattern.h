// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/calib/board.h"
#include "tenter/calib/byte_image.h"
#include "tenter/core/types.h"

namespace tenter {

/// What is printed on a surface, in the surface's own coordinates [m].
class Pattern {
 public:
  virtual ~Pattern() = default;
  /// Share of light that comes back from around a place. @param size_m  of what a ray stands for.
  virtual double albedo(double x, double y, double size_m) const = 0;
};

inline constexpr double kBlackAlbedo = 0.05, kWhiteAlbedo = 0.85;

/// Rectangular black and white cells between lines, white outside. Averages over the ray's size
/// exactly, so that edges stand where they are whatever the number of rays.
class CellPattern : public Pattern {
 public:
  /// A marker of side `size_m` in the middle of white.
  CellPattern(const ByteImage& cells, double size_m);
  /// A calibration board; its corner 0 is (0, 0), y down.
  explicit CellPattern(const Board& board);
  double albedo(double x, double y, double size_m) const override;

 private:
  bool white(int column, int row) const;
  std::vector<double> x_lines_, y_lines_;
  std::vector<bool> white_;  ///< Rows of cells between the lines.
};

/// Wavelet noise in grey, printed over the flat sample.
class NoisePattern : public Pattern {
 public:
  /// @param reach_m  the pattern covers 0 to this along both axes.
  NoisePattern(double reach_m, double feature_m, unsigned seed);
  double albedo(double x, double y, double size_m) const override;

 private:
  int side_;
  double step_m_;
  std::vector<float> albedo_;
};

}  // namespace tenter
