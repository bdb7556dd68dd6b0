// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string_view>

namespace tenter {

/// A file that the program carries within itself.
struct ShippedFile {
  std::string_view name;  ///< Without folder and extension: "stretch-weft".
  std::string_view text;
};

std::span<const ShippedFile> shippedProtocols();
std::span<const ShippedFile> shippedRegisterMaps();

/// Nothing if there is none of that name.
const ShippedFile* findShippedFile(std::span<const ShippedFile> files, std::string_view name);

}  // namespace tenter
