// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

namespace tenter::reconstruction_test {

/// Errors of one component, and how they compare with their standard deviations.
class Errors {
 public:
  void add(double error, double sigma) {
    sum_ += error;
    squares_ += error * error;
    inside_ += std::abs(error) < sigma ? 1.0 : 0.0;
    count_ += 1.0;
  }
  double count() const { return count_; }
  double mean() const { return sum_ / count_; }
  double rms() const { return std::sqrt(squares_ / count_); }
  /// Share within one standard deviation.
  double inside() const { return inside_ / count_; }

 private:
  double sum_ = 0.0, squares_ = 0.0, inside_ = 0.0, count_ = 0.0;
};

}  // namespace tenter::reconstruction_test
