// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace tenter {

inline constexpr int kMathematicsNice = 5, kPicturesNice = 15;

/// Makes the calling thread one that gives way: what answers the daemon must wait neither for the
/// mathematics nor for pictures. Where that cannot be, all is slower.
void yieldToOthers(int nice);

}  // namespace tenter
