// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

namespace tenter {

/// The pixels of a square subset, row by row. Rows are padded to a multiple of four, so that sums
/// run over four pixels at once; padding counts with `inside` 0.
struct SubsetGrid {
  explicit SubsetGrid(int side_px);

  int count() const { return side * side; }
  std::size_t size() const { return static_cast<std::size_t>(side) * stride; }

  int side, radius, stride;
  std::vector<float> dx;      ///< One row: offset from the centre [px]; padding repeats the last.
  std::vector<float> a, a2;   ///< One row: dx / radius, and its square.
  std::vector<float> inside;  ///< One row: 1, in the padding 0.
};

}  // namespace tenter
