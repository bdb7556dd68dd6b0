// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

namespace tenter {

/// The value of a key of a JSON object, byte for byte as it stands in the text; empty if the key is
/// not there. Precondition: `object` is valid JSON; keys with escapes are not found.
std::string_view rawMember(std::string_view object, std::string_view key);

/// Whether a text is one JSON object that fits on a line: no control characters, UTF-8.
bool isJsonObjectOnOneLine(std::string_view text);

}  // namespace tenter
