// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string_view>
#include <vector>

namespace tenter {

/// Numbers separated by white space, commas, or brackets and braces of either kind; nothing if
/// there is anything else, a number that is not finite, or more than `most`.
std::optional<std::vector<double>> parseNumbers(std::string_view text, std::size_t most = 4096);

}  // namespace tenter
