// SPDX-License-Identifier: GPL-3.0-or-later
// Four floats that are added and multiplied at once, in the same order on every machine.
#pragma once

#include <cstring>

namespace tenter {

using Float4 [[gnu::vector_size(16)]] = float;

inline Float4 load4(const float* from) {
  Float4 value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

inline void store4(float* to, Float4 value) { std::memcpy(to, &value, sizeof value); }

inline float sum(Float4 v) { return (v[0] + v[1]) + (v[2] + v[3]); }

}  // namespace tenter
