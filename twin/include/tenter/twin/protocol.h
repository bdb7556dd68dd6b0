// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string_view>

#include "tenter/core/result.h"

namespace tenter {

/// One way to deform the sample [Est12] sec. 3.2.
struct ProtocolInfo {
  std::string_view id;           ///< "stretch-weft".
  std::string_view description;  ///< One sentence.
  bool for_fitting = true;       ///< False: kept for evaluation (complex-shear, corner-pull).
  bool has_cords = true;         ///< False: the table tests, positions only.
  int default_frames = 60;
};

/// All protocols: stretch-weft stretch-warp shear bend-weft bend-warp bend-bias complex-shear
/// corner-pull.
std::span<const ProtocolInfo> protocols();

/// Error names the protocols there are.
Result<const ProtocolInfo*> findProtocol(std::string_view id);

}  // namespace tenter
