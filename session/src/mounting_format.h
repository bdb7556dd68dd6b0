// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

namespace tenter::mounting_format {

inline constexpr const char* kFormat = "tenter-mounting";
inline constexpr const char* kUnits = "SI";
inline constexpr std::size_t kMaxName = 200;
inline constexpr std::size_t kMaxClips = 64, kMaxCords = 256, kMaxTags = 256, kMaxBodies = 64,
                             kMaxOutline = 64;
inline constexpr std::int64_t kMaxChannel = 255, kMaxTagId = 100'000, kMaxFrame = 1'000'000'000;

}  // namespace tenter::mounting_format
