// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>

#include "register_map_decode.h"
#include "tenter/rig/load_cell.h"

namespace tenter {

/// Refuses weights that a well-formed answer carries and that cannot be true, from what the cell
/// can bear and from the last weight that was believed. After such a weight the next ones count
/// only once some in a row were good.
class LoadCellPlausibility {
 public:
  explicit LoadCellPlausibility(const LoadCellConfig& config);

  /// The fault of one sample, kNone if it is to be believed. `weights` are as decoded, before the
  /// cell's own direction.
  LoadCellFault judge(const DecodedWeights& weights, std::int64_t stamp_ns);

 private:
  LoadCellFault judgeValue(const DecodedWeights& weights) const;
  bool isFlipped(double gross_N) const;
  bool isStuck(const DecodedWeights& weights, std::int64_t stamp_ns);
  bool passesProbation(double gross_N);
  double tension_N(double weight_N) const { return reversed_ ? -weight_N : weight_N; }

  bool reversed_;
  double capacity_N_, lowest_N_;
  std::int64_t stuck_after_ns_;
  std::optional<double> last_N_;       // believed
  std::optional<double> candidate_N_;  // of the probation
  std::uint64_t raw_ = 0;
  std::int64_t raw_since_ns_ = 0;
  int same_raw_ = 0;
  int good_to_come_;
  bool flipped_ = false;  // the last value that was looked at had the wrong sign
};

}  // namespace tenter
