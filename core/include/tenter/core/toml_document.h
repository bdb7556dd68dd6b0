// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "tenter/core/json_reader.h"

namespace tenter {

/// The TOML document as JSON, so that one kind of reader checks both. Dates and numbers that are
/// not finite are refused. Errors carry line and column, or the key.
Result<nlohmann::json> jsonOfToml(std::string_view toml, const std::string& file);

/// Reports the first key of the object that is none of these; `page` says where they are described.
void onlyKnownKeys(JsonReader& in, std::initializer_list<std::string_view> keys,
                   const std::string& page);

}  // namespace tenter
