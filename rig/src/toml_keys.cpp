// SPDX-License-Identifier: GPL-3.0-or-later
#include "toml_keys.h"

#include <algorithm>

namespace tenter {

void onlyKnownKeys(JsonReader& in, std::initializer_list<std::string_view> keys,
                   const std::string& page) {
  if (!in.ok() || !in.json().is_object()) return;
  for (const auto& [key, value] : in.json().items()) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      in.fail(key, "is not a key here", "see " + page);
    }
  }
}

}  // namespace tenter
