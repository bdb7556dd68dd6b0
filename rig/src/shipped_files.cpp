// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/shipped_files.h"

#include <algorithm>

namespace tenter {

const ShippedFile* findShippedFile(std::span<const ShippedFile> files, std::string_view name) {
  const auto found = std::find_if(files.begin(), files.end(),
                                  [&](const ShippedFile& file) { return file.name == name; });
  return found == files.end() ? nullptr : &*found;
}

}  // namespace tenter
