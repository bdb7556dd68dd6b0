// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/wavelet_noise.h"

#include <array>
#include <cmath>
#include <random>

#include "tenter/core/result.h"

namespace tenter {

namespace {

/// Half of the analysis filter of [CD05], from its middle outwards; the other half mirrors it.
constexpr std::array kAnalysis = {0.655340,  0.033979,  -0.243780, -0.025936, 0.103311,  0.011655,
                                  -0.044412, -0.005040, 0.019120,  0.002172,  -0.008233, -0.000938,
                                  0.003545,  0.000410,  -0.001528, 0.000334};
/// Refinement of a quadratic B-spline.
constexpr std::array kRefinement = {0.25, 0.75, 0.75, 0.25};

int wrapped(int i, int size) { return ((i % size) + size) % size; }

/// What is left of a row after halving its resolution and doubling it again.
Eigen::VectorXd coarsePart(const Eigen::VectorXd& fine) {
  const int size = static_cast<int>(fine.size()), half = size / 2;
  const int taps = static_cast<int>(kAnalysis.size());
  Eigen::VectorXd coarse = Eigen::VectorXd::Zero(half), out = Eigen::VectorXd::Zero(size);
  for (int i = 0; i < half; ++i) {
    for (int k = 0; k < taps; ++k) {
      coarse[i] +=
          kAnalysis[k] * (fine[wrapped(2 * i + k + 1, size)] + fine[wrapped(2 * i - k, size)]);
    }
  }
  for (int i = 0; i < size; ++i) {
    // The fine spline's i-th function is a part of two coarse ones.
    for (int k = i / 2 - 1; k <= i / 2 + 1; ++k) {
      const int tap = i - 2 * k + 1;
      if (tap >= 0 && tap < 4) out[i] += kRefinement[tap] * coarse[wrapped(k, half)];
    }
  }
  return out;
}

std::array<double, 3> splineWeights(double t) {
  return {0.5 * (1.0 - t) * (1.0 - t), 0.5 + t * (1.0 - t), 0.5 * t * t};
}

}  // namespace

WaveletNoiseBand::WaveletNoiseBand(int columns, int rows, unsigned seed)
    : coefficients_(rows, columns) {
  require(columns >= 4 && rows >= 4 && columns % 2 == 0 && rows % 2 == 0,
          "sizes are even, 4 or more");
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gaussian;
  for (double& value : coefficients_.reshaped()) value = gaussian(random);
  Eigen::MatrixXd coarse = coefficients_;
  for (int row = 0; row < rows; ++row) {
    coarse.row(row) = coarsePart(coarse.row(row).transpose()).transpose();
  }
  for (int column = 0; column < columns; ++column) {
    coarse.col(column) = coarsePart(coarse.col(column));
  }
  coefficients_ -= coarse;
}

double WaveletNoiseBand::at(double x, double y) const {
  const int columns = static_cast<int>(coefficients_.cols());
  const int rows = static_cast<int>(coefficients_.rows());
  const double left = std::floor(x), top = std::floor(y);
  const auto wx = splineWeights(x - left), wy = splineWeights(y - top);
  double sum = 0.0;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      sum += wx[i] * wy[j] *
             coefficients_(wrapped(static_cast<int>(top) + j - 1, rows),
                           wrapped(static_cast<int>(left) + i - 1, columns));
    }
  }
  return sum;
}

}  // namespace tenter
