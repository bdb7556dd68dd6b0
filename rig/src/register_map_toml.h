// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "tenter/core/result.h"

namespace tenter {

/// The TOML document as JSON, so that one kind of reader checks both. Dates and numbers that are
/// not finite are refused. Errors carry line and column, or the key.
Result<nlohmann::json> jsonOfToml(std::string_view toml, const std::string& file);

}  // namespace tenter
