// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/core/types.h"

namespace tenter {

/// Named arrays, one column an item.
using VtpArrays = std::map<std::string, Eigen::MatrixXd>;

/// Points, each a cell of its own, with point data (VTP, binary).
Result<void> writeVtpPoints(const std::filesystem::path& file, const Points3& points,
                            const VtpArrays& data);
/// Line segments with cell data.
Result<void> writeVtpLines(const std::filesystem::path& file, const Points3& points,
                           const std::vector<std::array<int, 2>>& lines, const VtpArrays& data);

}  // namespace tenter
