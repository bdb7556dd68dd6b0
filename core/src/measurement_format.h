// SPDX-License-Identifier: GPL-3.0-or-later
// Names that the reader and the writer of measurement folders share.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "tenter/core/measurement.h"

namespace tenter::measurement_format {

inline constexpr const char* kFormat = "tenter-measurement";
inline constexpr const char* kUnits = "SI";
inline constexpr const char* kHeaderFile = "measurement.json";
inline constexpr const char* kFramesFile = "frames.jsonl";
inline constexpr const char* kRestFile = "rest.vtp";
inline constexpr const char* kPvdFile = "frames.pvd";
inline constexpr const char* kFramesFolder = "frames";
inline constexpr const char* kSigmaArray = "sigma_m";
inline constexpr const char* kSigmaAxesArray = "sigma_axes_m";
inline constexpr const char* kValidArray = "valid";
inline constexpr int kMaxFrames = 100'000;

inline constexpr std::array<std::pair<Branch, std::string_view>, 3> kBranches{
    {{Branch::kUnknown, "unknown"},
     {Branch::kLoading, "loading"},
     {Branch::kUnloading, "unloading"}}};

/// "frames/000012.vtp", relative to the folder.
inline std::string meshFileOfFrame(std::size_t frame) {
  const std::string digits = std::to_string(frame);
  std::string name = std::string(kFramesFolder) + "/";
  name.append(digits.size() < 6 ? 6 - digits.size() : 0, '0');
  return name + digits + ".vtp";
}

inline std::string lineOfFrame(std::size_t frame) { return "line " + std::to_string(frame + 1); }

}  // namespace tenter::measurement_format
