// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "tenter/reconstruction/rest_surface.h"

namespace tenter {

/// What a subset makes of heights that are given at nodes, cubic in between: weights of the nodes
/// around its middle, along one axis [-half, half].
struct SubsetWeights {
  int half = 0;
  std::vector<double> mean;       ///< Of an affine subset, which sees the mean.
  std::vector<double> quadratic;  ///< Of a quadratic one, which sees through curvature.

  /// @param half_cells  Half the subset's side over the nodes' spacing.
  explicit SubsetWeights(double half_cells);
};

/// How heights come out of matching subsets and of passes over the surface they give
/// (docs/reconstruction.md): a linear filter on the true heights and on the images' noise alike.
struct HeightFilter {
  HeightNoise noise;
  double difference = 0.0;  ///< Variance of a first match less the last height, in the same unit.
  double leak = 0.0;        ///< What of a first match's own errors is left, in variance.
};

/// @param order        Of the first matches' warps.
/// @param half_cells   Half the subset's side over the nodes' spacing.
/// @param reach        Nodes each way over which heights are smoothed between passes; 0: not at
///                     all.
HeightFilter heightFilter(int order, double half_cells, int reach, int passes);

}  // namespace tenter
