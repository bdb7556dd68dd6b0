// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tenter {

/// A pixel format of GenICam that images may have: one grey value, not packed.
struct PixelFormatRow {
  std::string_view name;
  std::uint32_t code;  ///< PFNC.
  int bits;
};

const PixelFormatRow* findPixelFormat(std::string_view name);
const PixelFormatRow* findPixelFormat(std::uint32_t code);
/// "Mono8, Mono10, ...".
std::string pixelFormatNames();

}  // namespace tenter
