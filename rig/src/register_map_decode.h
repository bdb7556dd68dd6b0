// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>

#include "tenter/rig/load_cell.h"
#include "tenter/rig/register_map.h"

namespace tenter {

/// Registers as they were read, by address.
class RegisterImage {
 public:
  void clear() { words_.clear(); }
  void put(int first, std::span<const std::uint16_t> words);
  std::optional<std::uint16_t> at(int address) const;

 private:
  std::map<int, std::uint16_t> words_;
};

/// Newtons of one count, as the amplifier's settings have it now.
struct WeightScale {
  double newtons_per_count = 0.0, newtons_per_unit = 0.0;
  bool operator==(const WeightScale&) const = default;
};

/// Nothing if a register is missing or says what the map does not know.
std::optional<WeightScale> scaleOf(const RegisterMap& map, const RegisterImage& image);

struct DecodedWeights {
  LoadCellFault fault = LoadCellFault::kNone;  ///< One of the amplifier's, or kInconsistent.
  double gross_N = 0.0, net_N = 0.0;
  double swapped_gross_N = 0.0;  ///< The gross weight if its two words were exchanged; may be NaN.
  std::uint64_t raw_gross = 0;   ///< Its bits, to see whether any of them ever moves.
  bool stable = false, net_mode = false;
};

/// Status and weights. Precondition: the image holds what every scan reads.
DecodedWeights decodeWeights(const RegisterMap& map, const RegisterImage& image,
                             const WeightScale& scale);

}  // namespace tenter
