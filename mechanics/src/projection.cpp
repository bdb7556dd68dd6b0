// SPDX-License-Identifier: GPL-3.0-or-later
#include "projection.h"

#include "tenter/core/result.h"
#include "tenter/mechanics/energy_term.h"

namespace tenter {

void projectPositiveSemiDefinite(Eigen::Ref<Eigen::MatrixXd> block) {
  constexpr int kMax = 3 * Stencil::kMaxNodes + Stencil::kMaxScalars;
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMax, kMax>;
  require(block.rows() == block.cols() && block.rows() <= kMax,
          "projectPositiveSemiDefinite: not a square element block");
  if (block.rows() == 0) return;
  Small small = block;
  clampEigenvalues(&small);
  block = small;
}

}  // namespace tenter
