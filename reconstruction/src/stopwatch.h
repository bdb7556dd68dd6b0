// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>

#include "tenter/reconstruction/correlate.h"

namespace tenter {

/// Time since it was made, of the clock and of all threads of the process.
class Stopwatch {
 public:
  void read(CorrelationField& field) const;

 private:
  static double processSeconds();

  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  double cpu_begin_ = processSeconds();
};

}  // namespace tenter
