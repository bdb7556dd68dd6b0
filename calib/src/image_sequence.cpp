// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/image_sequence.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <system_error>

namespace tenter {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxDigits = 9;

/// A part of a path with the counter in it: what stands before and behind, and the least digits.
struct Counter {
  std::string before, behind;
  std::size_t digits = 1;
};

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

/// Digits of "{index}" or "{index:04}", from the text between name and brace; nothing if neither.
std::optional<std::size_t> digitsOf(std::string_view format) {
  if (format.empty()) return 1;
  const bool two = format.size() == 2, three = format.size() == 3;
  if (!(two || three) || format[0] != ':') return std::nullopt;
  if (three && format[1] != '0') return std::nullopt;
  const char digit = format.back();
  if (digit < '1' || digit > '9') return std::nullopt;
  return static_cast<std::size_t>(digit - '0');
}

Error badPattern(const std::string& pattern, const std::string& reason,
                 const std::string& counter) {
  return usageError("the pattern '" + pattern + "' " + reason,
                    "such as DIR/{camera}_{" + counter + ":04}.png");
}

Result<Counter> counterIn(const std::string& part, const std::string& pattern,
                          const std::string& counter) {
  const std::size_t open = part.find("{" + counter), close = part.find('}', open);
  if (close == std::string::npos) return badPattern(pattern, "has an open brace", counter);
  const std::size_t name_end = open + 1 + counter.size();
  const auto digits = digitsOf(std::string_view(part).substr(name_end, close - name_end));
  if (!digits) {
    return badPattern(pattern, "has a counter that is not understood", counter);
  }
  return Counter{part.substr(0, open), part.substr(close + 1), *digits};
}

std::optional<int> numberIn(const std::string& name, const Counter& counter) {
  if (name.size() <= counter.before.size() + counter.behind.size()) return std::nullopt;
  if (!name.starts_with(counter.before) || !name.ends_with(counter.behind)) return std::nullopt;
  const std::string digits = name.substr(
      counter.before.size(), name.size() - counter.before.size() - counter.behind.size());
  if (digits.size() < counter.digits || digits.size() > kMaxDigits) return std::nullopt;
  // More digits than asked for are an overflow of the width, which has no leading zero.
  if (digits.size() > counter.digits && digits[0] == '0') return std::nullopt;
  if (!std::all_of(digits.begin(), digits.end(),
                   [](unsigned char c) { return std::isdigit(c) != 0; })) {
    return std::nullopt;
  }
  return std::stoi(digits);
}

}  // namespace

Result<std::map<int, fs::path>> findImages(const std::string& pattern, const std::string& camera,
                                           const std::string& counter) {
  const std::string opening = "{" + counter;
  const auto first = pattern.find(opening);
  if (first == std::string::npos) {
    return badPattern(pattern, "has no {" + counter + "}", counter);
  }
  if (pattern.find(opening, first + 1) != std::string::npos) {
    return badPattern(pattern, "has {" + counter + "} more than once", counter);
  }
  const auto begin = pattern.rfind('/', first);
  const auto end = pattern.find('/', first);
  const std::string folder = begin == std::string::npos ? "." : pattern.substr(0, begin + 1);
  const std::string part =
      pattern.substr(begin + 1, end == std::string::npos ? end : end - begin - 1);
  const auto parsed = counterIn(part, pattern, counter);
  if (!parsed) return parsed.error();
  const auto named = [&](const std::string& text) { return replaced(text, "{camera}", camera); };
  const Counter wanted{named(parsed->before), named(parsed->behind), parsed->digits};
  const std::string rest = end == std::string::npos ? "" : named(pattern.substr(end + 1));

  std::map<int, fs::path> found;
  std::error_code error;
  fs::directory_iterator entries(named(folder), error);
  if (error) return badInput(named(folder), "", "cannot be read: " + error.message());
  for (; entries != fs::directory_iterator(); entries.increment(error)) {
    const std::string name = entries->path().filename().string();
    const auto number = numberIn(name, wanted);
    if (!number) continue;
    fs::path file = begin == std::string::npos ? fs::path(name) : fs::path(named(folder)) / name;
    if (!rest.empty()) file /= rest;
    if (fs::exists(file, error)) found.emplace(*number, std::move(file));
  }
  if (found.empty()) {
    return badInput(named(folder), "", "holds no image of the camera '" + camera + "'",
                    "the pattern is " + named(pattern));
  }
  return found;
}

}  // namespace tenter
