// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/core/types.h"

namespace tenter::import {

/// A numeric table with the line of the file that each row came from.
struct NumberedTable {
  std::string file;
  Eigen::MatrixXd values;
  std::vector<int> line;  ///< From 1.

  /// "line 7".
  std::string place(Eigen::Index row) const;
};

Result<NumberedTable> readNumberedTable(const std::filesystem::path& csv, int columns);

/// A positive length, angle or density that a person typed: finite, and of a size that cloth has.
/// `option` is its name on the command line.
Result<void> checkRange(const std::string& option, double value, double min, double max,
                        const std::string& unit);

/// A number with six significant digits, for messages.
std::string shown(double value);

}  // namespace tenter::import
