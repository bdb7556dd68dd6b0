// SPDX-License-Identifier: GPL-3.0-or-later
#include "random_numbers.h"

#include <cmath>
#include <numbers>

namespace tenter {
namespace {

/// FNV-1a.
std::uint64_t hashOf(std::string_view text, std::uint64_t hash) {
  for (const char c : text) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 1099511628211ULL;
  }
  return hash;
}

}  // namespace

RandomNumbers::RandomNumbers(std::uint64_t seed, std::string_view label)
    : engine_(hashOf(label, 14695981039346656037ULL ^ (seed * 0x9E3779B97F4A7C15ULL))) {}

double RandomNumbers::uniform() {
  constexpr double kStep = 1.0 / 9007199254740992.0;  // 2^-53
  return static_cast<double>(engine_() >> 11) * kStep;
}

double RandomNumbers::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  const double angle = 2.0 * std::numbers::pi * uniform();
  spare_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

Vec3 RandomNumbers::normal3() {
  const double x = normal(), y = normal(), z = normal();
  return {x, y, z};
}

}  // namespace tenter
