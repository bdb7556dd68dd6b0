// SPDX-License-Identifier: GPL-3.0-or-later
#include "pixel_formats.h"

#include <algorithm>
#include <array>

namespace tenter {
namespace {

constexpr std::array<PixelFormatRow, 4> kRows{{{"Mono8", 0x01080001, 8},
                                               {"Mono10", 0x01100003, 10},
                                               {"Mono12", 0x01100005, 12},
                                               {"Mono16", 0x01100007, 16}}};

template <class Match>
const PixelFormatRow* find(Match match) {
  const auto row = std::find_if(kRows.begin(), kRows.end(), match);
  return row == kRows.end() ? nullptr : &*row;
}

}  // namespace

const PixelFormatRow* findPixelFormat(std::string_view name) {
  return find([&](const PixelFormatRow& row) { return row.name == name; });
}

const PixelFormatRow* findPixelFormat(std::uint32_t code) {
  return find([&](const PixelFormatRow& row) { return row.code == code; });
}

std::string pixelFormatNames() {
  std::string names;
  for (const PixelFormatRow& row : kRows) {
    names += (names.empty() ? "" : ", ") + std::string(row.name);
  }
  return names;
}

}  // namespace tenter
