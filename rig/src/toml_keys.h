// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "tenter/core/json_reader.h"

namespace tenter {

/// Reports the first key of the object that is none of these; `page` says where they are described.
void onlyKnownKeys(JsonReader& in, std::initializer_list<std::string_view> keys,
                   const std::string& page);

}  // namespace tenter
