// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tenter/reconstruction/correlate.h"

namespace tenter {

/// First line of a field file, docs/formats/correlation-field.md.
inline constexpr std::string_view kFieldHeader = "x,y,u,v,sigma,zncc,valid";

/// The file of a field: one row a point, in their order; `nan` where there is no match.
std::string formatField(const CorrelationField& field);

/// Points from a table of two columns, x and y [px]; an error names line and column.
Result<std::vector<Vec2>> readPoints(const std::filesystem::path& file);

}  // namespace tenter
