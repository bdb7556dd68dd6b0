// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/files.h"
#include "text_scan.h"

namespace tenter {

namespace {

constexpr std::size_t kLimit_bytes = std::size_t{1} << 28;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::string_view kBlanks = " \t\r";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// Cells between commas or semicolons, empty ones kept; without either, between runs of blanks.
std::vector<std::string_view> cellsOf(std::string_view line) {
  const bool blanks_only = line.find_first_of(",;") == std::string_view::npos;
  const std::string_view separators = blanks_only ? " \t" : ",;";
  std::vector<std::string_view> cells;
  while (true) {
    const auto end = line.find_first_of(separators);
    const std::string_view cell = trimmed(line.substr(0, end));
    if (!blanks_only || !cell.empty()) cells.push_back(cell);
    if (end == std::string_view::npos) return cells;
    line.remove_prefix(end + 1);
  }
}

bool isHeader(const std::vector<std::string_view>& cells) {
  for (const std::string_view cell : cells) {
    if (parseNumber<double>(cell)) return false;
  }
  return true;
}

Result<void> appendRow(const std::vector<std::string_view>& cells, int columns,
                       const std::string& file, int line_number, std::vector<double>& values) {
  const std::string line = "line " + std::to_string(line_number);
  if (static_cast<int>(cells.size()) != columns) {
    return badInput(
        file, line,
        "has " + std::to_string(cells.size()) + " columns instead of " + std::to_string(columns),
        "give one row of " + std::to_string(columns) + " numbers a line");
  }
  for (int column = 0; column < columns; ++column) {
    const std::string_view cell = cells[static_cast<std::size_t>(column)];
    const auto value = parseNumber<double>(cell);
    const std::string place = line + ", column " + std::to_string(column + 1);
    if (!value) {
      return badInput(file, place, "\"" + std::string(cell.substr(0, 40)) + "\" is not a number",
                      "write numbers with a decimal point");
    }
    if (!std::isfinite(*value)) return badInput(file, place, "the number is not finite");
    values.push_back(*value);
  }
  return {};
}

}  // namespace

Result<Eigen::MatrixXd> readNumericTable(const std::filesystem::path& path, int columns) {
  require(columns > 0, "a table has at least one column");
  const auto content = readFile(path, kLimit_bytes);
  if (!content) return content.error();
  const std::string file = path.string();
  std::string_view rest = *content;
  if (rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());

  std::vector<double> values;
  bool first = true;
  for (int line_number = 1; !rest.empty(); ++line_number) {
    const auto end = rest.find('\n');
    const std::string_view line = trimmed(rest.substr(0, end));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (line.empty() || line.front() == '#') continue;
    const auto cells = cellsOf(line);
    const bool header = first && isHeader(cells);
    first = false;
    if (header) continue;
    if (auto done = appendRow(cells, columns, file, line_number, values); !done) {
      return done.error();
    }
  }
  if (values.empty()) return badInput(file, "", "holds no rows of numbers");
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto rows = static_cast<Eigen::Index>(values.size()) / columns;
  return Eigen::MatrixXd(Eigen::Map<const RowMajor>(values.data(), rows, columns));
}

}  // namespace tenter
