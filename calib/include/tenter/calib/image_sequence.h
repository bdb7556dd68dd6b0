// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "tenter/core/result.h"

namespace tenter {

/// Files that a pattern such as "DIR/{camera}{index:02}.jpg" stands for. `{camera}` is replaced by
/// the camera's name and may stand anywhere, also more than once. The counter, `{index}` here,
/// stands once, in any part of the path; `{index:02}` matches at least two digits, filled with
/// zeros on the left as printf's %02d does, so that 7 is "07" and 100 is "100". All other
/// characters stand for themselves. Gaps in the numbers are allowed.
/// @return by number, 0 to 999999999, ascending. Error if the pattern cannot be understood or
/// nothing matches.
Result<std::map<int, std::filesystem::path>> findImages(const std::string& pattern,
                                                        const std::string& camera,
                                                        const std::string& counter = "index");

}  // namespace tenter
