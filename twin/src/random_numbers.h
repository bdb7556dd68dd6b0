// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <random>
#include <string_view>

#include "tenter/core/types.h"

namespace tenter {

/// Random numbers that are the same on every machine: the standard fixes mt19937_64 but not its
/// distributions.
class RandomNumbers {
 public:
  /// Streams of different labels are independent.
  RandomNumbers(std::uint64_t seed, std::string_view label);

  double uniform();  ///< In [0, 1).
  double normal();   ///< Mean 0, variance 1; Box-Muller.
  Vec3 normal3();

 private:
  std::mt19937_64 engine_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace tenter
