// SPDX-License-Identifier: GPL-3.0-or-later
#include "number_list.h"

#include <charconv>
#include <cmath>

namespace tenter {

std::optional<std::vector<double>> parseNumbers(std::string_view text, std::size_t most) {
  constexpr std::string_view kSeparators = " \t\r\n,[]{}";
  std::vector<double> out;
  for (;;) {
    const auto begin = text.find_first_not_of(kSeparators);
    if (begin == std::string_view::npos) return out;
    text.remove_prefix(begin);
    std::string_view word = text.substr(0, text.find_first_of(kSeparators));
    text.remove_prefix(word.size());
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0.0;
    const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
    if (read.ec != std::errc() || read.ptr != word.data() + word.size()) return std::nullopt;
    if (!std::isfinite(value) || out.size() == most) return std::nullopt;
    out.push_back(value);
  }
}

}  // namespace tenter
