// SPDX-License-Identifier: GPL-3.0-or-later
#include "raw_json.h"

#include <algorithm>

#include "tenter/core/json_reader.h"

namespace tenter {

namespace {

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

std::size_t skipBlanks(std::string_view text, std::size_t at) {
  while (at < text.size() && isBlank(text[at])) ++at;
  return at;
}

/// Place behind the string that begins at `at`.
std::size_t skipString(std::string_view text, std::size_t at) {
  for (++at; at < text.size() && text[at] != '"'; ++at) {
    if (text[at] == '\\') ++at;
  }
  return std::min(at + 1, text.size());
}

/// Place of the ',' or the bracket that ends the value beginning at `at`.
std::size_t skipValue(std::string_view text, std::size_t at) {
  int depth = 0;
  while (at < text.size()) {
    const char c = text[at];
    if (c == '"') {
      at = skipString(text, at);
      continue;
    }
    const bool closes = c == '}' || c == ']';
    if (depth == 0 && (c == ',' || closes)) return at;
    if (c == '{' || c == '[') ++depth;
    if (closes) --depth;
    ++at;
  }
  return at;
}

}  // namespace

std::string_view rawMember(std::string_view object, std::string_view key) {
  std::size_t at = skipBlanks(object, 0) + 1;
  while (true) {
    at = skipBlanks(object, at);
    if (at >= object.size() || object[at] != '"') return {};
    const std::size_t key_end = skipString(object, at);
    const std::string_view found = object.substr(at, key_end - at);
    const std::size_t begin = skipBlanks(object, skipBlanks(object, key_end) + 1);
    const std::size_t end = skipValue(object, begin);
    if (begin >= end) return {};
    if (found.size() == key.size() + 2 && found.substr(1, key.size()) == key) {
      std::string_view value = object.substr(begin, end - begin);
      while (!value.empty() && isBlank(value.back())) value.remove_suffix(1);
      return value;
    }
    at = end + 1;
  }
}

bool isJsonObjectOnOneLine(std::string_view text) {
  const bool on_one_line = std::none_of(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; });
  if (!on_one_line) return false;
  const auto document = parseJson(text, "");
  return document.ok() && document->is_object();
}

}  // namespace tenter
