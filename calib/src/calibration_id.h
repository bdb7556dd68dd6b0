// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tenter/core/files.h"

namespace tenter {

/// Names a calibration by its content: prefix and sixteen digits of the document's hash. The
/// document has no id yet.
inline std::string contentId(const std::string& prefix, const nlohmann::ordered_json& document) {
  constexpr std::size_t kDigits = 16;
  return prefix + sha256(document.dump()).substr(0, kDigits);
}

}  // namespace tenter
