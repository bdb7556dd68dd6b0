// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace tenter {

/// Room for d stress / d p of one element, 3 x count; one per thread, so it allocates only when a
/// thread meets a larger count.
inline Eigen::Block<Eigen::Matrix3Xd, 3, Eigen::Dynamic, true> parameterScratch(int count) {
  static thread_local Eigen::Matrix3Xd scratch;
  if (scratch.cols() < count) scratch.resize(3, count);
  return scratch.leftCols(count);
}

}  // namespace tenter
