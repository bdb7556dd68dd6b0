// SPDX-License-Identifier: GPL-3.0-or-later
#include "session_format.h"

#include <algorithm>

namespace tenter::session_format {

namespace {

constexpr std::size_t kFrameDigits = 6;
constexpr std::size_t kMaxFrameDigits = 16;

bool isDigit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

bool isCameraName(std::string_view name) {
  return !name.empty() && name.size() <= 64 &&
         std::all_of(name.begin(), name.end(), isNameCharacter);
}

bool isExtension(std::string_view name) {
  return !name.empty() && name.size() <= 8 && name != "part" &&
         std::all_of(name.begin(), name.end(), isLowerOrDigit);
}

bool isFrameFileName(std::string_view name) {
  constexpr std::string_view kPrefix = "frames/";
  if (!name.starts_with(kPrefix)) return false;
  name.remove_prefix(kPrefix.size());
  const auto digits =
      static_cast<std::size_t>(std::find_if_not(name.begin(), name.end(), isDigit) - name.begin());
  const std::size_t dot = name.find('.');
  return digits >= kFrameDigits && digits <= kMaxFrameDigits && dot != std::string_view::npos &&
         name[digits] == '-' && isCameraName(name.substr(digits + 1, dot - digits - 1)) &&
         isExtension(name.substr(dot + 1));
}

bool isRestFileName(std::string_view name) {
  constexpr std::string_view kPrefix = "rest/", kSuffix = ".png";
  if (!name.starts_with(kPrefix) || !name.ends_with(kSuffix)) return false;
  if (name.size() < kPrefix.size() + kSuffix.size()) return false;
  name.remove_prefix(kPrefix.size());
  name.remove_suffix(kSuffix.size());
  return isCameraName(name);
}

std::string padded(std::uint64_t number, std::size_t digits) {
  std::string text = std::to_string(number);
  if (text.size() < digits) text.insert(0, digits - text.size(), '0');
  return text;
}

std::string frameFileName(std::int64_t frame, std::string_view camera, std::string_view extension) {
  std::string name = std::string(kFramesFolder) + "/";
  name += padded(static_cast<std::uint64_t>(frame), kFrameDigits);
  name += '-';
  name += camera;
  name += '.';
  name += extension;
  return name;
}

}  // namespace tenter::session_format
