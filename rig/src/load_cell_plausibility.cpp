// SPDX-License-Identifier: GPL-3.0-or-later
#include "load_cell_plausibility.h"

#include <cmath>

namespace tenter {
namespace {

// A weight whose mirrored or word-swapped twin lies this near the last believed one, while it does
// not itself, is that twin: real loads hardly ever jump to just there within one scan.
constexpr double kTwinNearness_N = 0.05;
constexpr double kTwinNearness = 0.2;  // of the last weight
// A slack cord reads a little below zero, and a moment later may be taut.
constexpr double kSlack_N = 0.025;
// Between two readings of a slow bus a load may grow or shrink by so much and flip as well.
constexpr double kFarTwin = 3.0;
// Floats with exchanged words are mostly far too large or far too small. No amplifier resolves
// this.
constexpr double kSmallestWeight_N = 1e-6;
// Up to a tenth of floats with exchanged words look like weights; ten in a row do not.
constexpr int kProbationSamples = 10;
constexpr int kFewestStuckSamples = 5;

bool isNear(double a_N, double last_N) {
  return std::abs(a_N - last_N) <= kTwinNearness_N + kTwinNearness * std::abs(last_N);
}

bool startsProbation(LoadCellFault fault) {
  switch (fault) {
    case LoadCellFault::kOverRange:
    case LoadCellFault::kNotANumber:
    case LoadCellFault::kSignFlip:
    case LoadCellFault::kWordOrder:
    case LoadCellFault::kInconsistent:
    case LoadCellFault::kScaleChanged:
      return true;
    default:
      return false;
  }
}

}  // namespace

LoadCellPlausibility::LoadCellPlausibility(const LoadCellConfig& config)
    : reversed_(config.reversed),
      capacity_N_(config.capacity_N),
      lowest_N_(config.lowest_N),
      stuck_after_ns_(std::chrono::nanoseconds(config.stuck_after).count()),
      good_to_come_(kProbationSamples) {}

bool LoadCellPlausibility::isStuck(const DecodedWeights& weights, std::int64_t stamp_ns) {
  if (same_raw_ == 0 || weights.raw_gross != raw_) {
    raw_ = weights.raw_gross;
    raw_since_ns_ = stamp_ns;
    same_raw_ = 1;
    return false;
  }
  ++same_raw_;
  return stuck_after_ns_ > 0 && same_raw_ >= kFewestStuckSamples &&
         stamp_ns - raw_since_ns_ >= stuck_after_ns_;
}

/// Whether a reading that is not near the last believed one has the wrong sign. Once one was seen,
/// any of that sign is, however far the load has moved since.
bool LoadCellPlausibility::isFlipped(double gross_N) const {
  const bool grown_taut = gross_N > 0.0 && *last_N_ > -kSlack_N;
  if (isNear(-gross_N, *last_N_)) return !grown_taut;
  const bool opposite = gross_N * *last_N_ < 0.0 && std::abs(gross_N) > kTwinNearness_N;
  if (opposite && flipped_) return true;
  return opposite && *last_N_ > kTwinNearness_N && -gross_N > *last_N_ / kFarTwin &&
         -gross_N < *last_N_ * kFarTwin;
}

LoadCellFault LoadCellPlausibility::judgeValue(const DecodedWeights& weights) const {
  const double gross_N = tension_N(weights.gross_N);
  const double swapped_N = tension_N(weights.swapped_gross_N);
  if (last_N_ && !isNear(gross_N, *last_N_)) {
    if (isFlipped(gross_N)) return LoadCellFault::kSignFlip;
    if (isNear(swapped_N, *last_N_)) return LoadCellFault::kWordOrder;  // false for NaN
  }
  const bool tiny = gross_N != 0.0 && std::abs(gross_N) < kSmallestWeight_N;
  if (tiny) return LoadCellFault::kWordOrder;
  if (std::abs(gross_N) > capacity_N_) return LoadCellFault::kOverRange;
  if (gross_N < lowest_N_) return LoadCellFault::kSignFlip;
  return LoadCellFault::kNone;
}

bool LoadCellPlausibility::passesProbation(double gross_N) {
  if (!candidate_N_ || !isNear(gross_N, *candidate_N_)) good_to_come_ = kProbationSamples;
  candidate_N_ = gross_N;
  return --good_to_come_ == 0;
}

LoadCellFault LoadCellPlausibility::judge(const DecodedWeights& weights, std::int64_t stamp_ns) {
  const double gross_N = tension_N(weights.gross_N);
  const bool stuck = isStuck(weights, stamp_ns);
  LoadCellFault fault = weights.fault;
  if (fault == LoadCellFault::kNone || fault == LoadCellFault::kInconsistent) {
    const LoadCellFault value_fault = judgeValue(weights);  // says more than a sum that fails
    if (value_fault != LoadCellFault::kNone) fault = value_fault;
  }
  if (fault == LoadCellFault::kNone && stuck) fault = LoadCellFault::kStuck;
  if (startsProbation(fault)) good_to_come_ = kProbationSamples;
  if (fault == LoadCellFault::kNone || fault == LoadCellFault::kSignFlip)
    flipped_ = fault == LoadCellFault::kSignFlip;
  if (fault != LoadCellFault::kNone) return fault;
  if (good_to_come_ > 0 && !passesProbation(gross_N)) return LoadCellFault::kProbation;
  last_N_ = gross_N;
  return fault;
}

}  // namespace tenter
