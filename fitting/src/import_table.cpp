// SPDX-License-Identifier: GPL-3.0-or-later
#include "import_table.h"

#include <cmath>
#include <cstdio>
#include <string_view>
#include <utility>

#include "tenter/core/files.h"

namespace tenter::import {

namespace {

bool isData(std::string_view line) {
  const auto first = line.find_first_not_of(" \t\r\xEF\xBB\xBF");
  return first != std::string_view::npos && line[first] != '#';
}

}  // namespace

std::string NumberedTable::place(Eigen::Index row) const {
  return "line " + std::to_string(line[static_cast<std::size_t>(row)]);
}

Result<NumberedTable> readNumberedTable(const std::filesystem::path& csv, int columns) {
  auto values = readNumericTable(csv, columns);
  if (!values) return values.error();
  const auto content = readFile(csv);
  if (!content) return content.error();

  NumberedTable table{csv.string(), std::move(values).value(), {}};
  std::string_view rest = *content;
  for (int number = 1; !rest.empty(); ++number) {
    const auto end = rest.find('\n');
    if (isData(rest.substr(0, end))) table.line.push_back(number);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  }
  const auto rows = static_cast<std::size_t>(table.values.rows());
  if (table.line.size() == rows + 1) table.line.erase(table.line.begin());  // the header
  if (table.line.size() != rows) {
    return badInput(table.file, "", "changed while it was read", "try again");
  }
  return table;
}

Result<void> checkRange(const std::string& option, double value, double min, double max,
                        const std::string& unit) {
  if (std::isfinite(value) && value >= min && value <= max) return {};
  return badInput("", option,
                  "is " + shown(value) + " " + unit + ", outside " + shown(min) + " to " +
                      shown(max) + " " + unit,
                  "check the unit");
}

std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

}  // namespace tenter::import
