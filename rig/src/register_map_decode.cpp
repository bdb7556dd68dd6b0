// SPDX-License-Identifier: GPL-3.0-or-later
#include "register_map_decode.h"

#include <bit>
#include <cmath>
#include <string>
#include <utility>

namespace tenter {
namespace {

/// A magnitude and a sign that contradict each other have no value; neither have NaN and infinity.
struct Count {
  double value = 0.0;
  LoadCellFault fault = LoadCellFault::kNone;
};

std::uint32_t bitsOf(const WeightField& field, const RegisterImage& image, bool swapped) {
  const std::uint32_t first = image.at(field.address).value();
  if (registerCount(field.type) == 1) return first;
  const std::uint32_t second = image.at(field.address + 1).value();
  return field.high_word_first != swapped ? first << 16 | second : second << 16 | first;
}

Count magnitude(const WeightField& field, std::uint32_t bits, std::uint16_t status) {
  const std::uint32_t top = field.type == RegisterType::kU16 ? 0x8000U : 0x80000000U;
  const bool negative = field.negative_bit && ((status >> *field.negative_bit) & 1U) != 0;
  if (!field.twos_complement || (bits & top) == 0) {
    return {negative ? -static_cast<double>(bits) : static_cast<double>(bits)};
  }
  const double value = field.type == RegisterType::kU16
                           ? static_cast<std::int16_t>(bits)
                           : static_cast<double>(std::bit_cast<std::int32_t>(bits));
  if (!negative) return {value, LoadCellFault::kSignFlip};
  return {value};
}

Count countOf(const WeightField& field, std::uint32_t bits, std::uint16_t status) {
  switch (field.type) {
    case RegisterType::kU16:
    case RegisterType::kU32:
      return magnitude(field, bits, status);
    case RegisterType::kI16:
      return {static_cast<double>(static_cast<std::int16_t>(bits))};
    case RegisterType::kI32:
      return {static_cast<double>(std::bit_cast<std::int32_t>(bits))};
    case RegisterType::kF32:
      break;
  }
  const auto number = std::bit_cast<float>(bits);
  if (!std::isfinite(number)) return {0.0, LoadCellFault::kNotANumber};
  return {static_cast<double>(number)};
}

LoadCellFault faultOfStatus(const StatusRegister& status, std::uint16_t word) {
  LoadCellFault fault = LoadCellFault::kNone;
  for (std::size_t bit = 0; bit < status.bits.size(); ++bit) {
    if (((word >> bit) & 1U) == 0) continue;
    if (status.bits[bit] == StatusMeaning::kCellError) return LoadCellFault::kCellError;
    if (status.bits[bit] == StatusMeaning::kConverterError) fault = LoadCellFault::kConverterError;
    if (status.bits[bit] == StatusMeaning::kOverRange && fault == LoadCellFault::kNone) {
      fault = LoadCellFault::kOverRange;
    }
  }
  return fault;
}

bool says(const StatusRegister& status, std::uint16_t word, StatusMeaning meaning) {
  for (std::size_t bit = 0; bit < status.bits.size(); ++bit) {
    if (status.bits[bit] == meaning && ((word >> bit) & 1U) != 0) return true;
  }
  return false;
}

bool knows(const StatusRegister& status, StatusMeaning meaning) {
  return says(status, 0xFFFF, meaning);
}

/// The choice that the source's bits make, or the constant; null if there is none.
template <class Rule, class T>
const T* chosen(const Rule& rule, const T& constant, const std::vector<T>& choices,
                const RegisterImage& image) {
  if (!rule.source) return &constant;
  const auto word = image.at(rule.source->address);
  if (!word) return nullptr;
  const unsigned index = rule.source->of(*word);
  return index < choices.size() ? &choices[index] : nullptr;
}

}  // namespace

void RegisterImage::put(int first, std::span<const std::uint16_t> words) {
  for (std::size_t i = 0; i < words.size(); ++i) words_[first + static_cast<int>(i)] = words[i];
}

std::optional<std::uint16_t> RegisterImage::at(int address) const {
  const auto found = words_.find(address);
  if (found == words_.end()) return std::nullopt;
  return found->second;
}

std::optional<WeightScale> scaleOf(const RegisterMap& map, const RegisterImage& image) {
  const double* scale = chosen(map.scale, map.scale.constant, map.scale.choices, image);
  const std::string* unit = chosen(map.unit, map.unit.constant, map.unit.choices, image);
  if (scale == nullptr || unit == nullptr) return std::nullopt;
  const std::optional<double> newtons = newtonsPerUnit(*unit);
  if (!newtons) return std::nullopt;
  return WeightScale{*scale * *newtons, *newtons};
}

DecodedWeights decodeWeights(const RegisterMap& map, const RegisterImage& image,
                             const WeightScale& scale) {
  const std::uint16_t status = image.at(map.status.address).value();
  DecodedWeights weights;
  weights.fault = faultOfStatus(map.status, status);
  weights.stable = knows(map.status, StatusMeaning::kStable)
                       ? says(map.status, status, StatusMeaning::kStable)
                       : !says(map.status, status, StatusMeaning::kUnstable);
  weights.net_mode = says(map.status, status, StatusMeaning::kNetMode);
  weights.raw_gross = bitsOf(map.gross, image, false);
  const Count gross = countOf(map.gross, bitsOf(map.gross, image, false), status);
  const Count net = countOf(map.net, bitsOf(map.net, image, false), status);
  const Count swapped = countOf(map.gross, bitsOf(map.gross, image, true), status);
  weights.gross_N = gross.value * scale.newtons_per_count;
  weights.net_N = net.value * scale.newtons_per_count;
  weights.swapped_gross_N =
      registerCount(map.gross.type) == 2 && swapped.fault == LoadCellFault::kNone
          ? swapped.value * scale.newtons_per_count
          : std::nan("");
  if (weights.fault == LoadCellFault::kNone) weights.fault = gross.fault;
  if (weights.fault == LoadCellFault::kNone) weights.fault = net.fault;
  if (!map.tare || weights.fault != LoadCellFault::kNone) return weights;
  const Count tare = countOf(*map.tare, bitsOf(*map.tare, image, false), status);
  const double sum_N = (net.value + tare.value) * scale.newtons_per_count;
  if (tare.fault != LoadCellFault::kNone) {
    weights.fault = tare.fault;
  } else if (std::abs(weights.gross_N - sum_N) > map.sum_tolerance * scale.newtons_per_unit) {
    weights.fault = LoadCellFault::kInconsistent;
  }
  return weights;
}

}  // namespace tenter
