// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/core/types.h"

namespace tenter {

/// One band of wavelet noise [CD05]: coefficients of a quadratic B-spline that has, but for
/// rounding, nothing of frequencies below a quarter cycle a sample. Repeats after `size` samples.
class WaveletNoiseBand {
 public:
  /// Precondition: sizes even, 4 or more.
  WaveletNoiseBand(int columns, int rows, unsigned seed);
  double at(double x, double y) const;  ///< [samples]; mean 0.
  const Eigen::MatrixXd& coefficients() const { return coefficients_; }

 private:
  Eigen::MatrixXd coefficients_;  ///< rows x columns.
};

}  // namespace tenter
