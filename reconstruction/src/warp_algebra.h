// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tenter/reconstruction/subset_warp.h"

namespace tenter {

/// warp o increment^-1, the inverse-compositional update: exact for warps of the first order, and
/// for those of the second up to their third derivatives [Gao15]. False, and the warp
/// left alone, if the increment cannot be inverted.
bool composeWithInverse(SubsetWarp& warp, const SubsetWarp& increment, int order);

}  // namespace tenter
