// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// Results of one fabric: property ("EMT", "2HG5") to value, in KES-FB units.
using KesResults = std::map<std::string, double, std::less<>>;

struct KesTable {
  std::string file;
  std::vector<std::string> fabrics;
  std::vector<KesResults> results;  ///< One a fabric.
};

/// A table of KES-FB results, one column a fabric (`property,unit,A,B...`) or one row a fabric
/// (`fabric,EMT,LT...`, then a row of units). Cells are separated by commas, semicolons or tabs;
/// decimal commas where commas do not separate; a byte-order mark is skipped. Every property is in
/// its KES unit and within what cloth can have; error names line, fabric and reason.
Result<KesTable> readKesTable(const std::filesystem::path& csv);

}  // namespace tenter
