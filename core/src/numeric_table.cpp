// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <optional>
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

bool isDigitAt(std::string_view line, std::size_t at) {
  return at < line.size() && line[at] >= '0' && line[at] <= '9';
}

/// Whether each comma stands between two digits, as a decimal comma does.
bool commasAreDecimal(std::string_view line) {
  for (auto at = line.find(','); at != std::string_view::npos; at = line.find(',', at + 1)) {
    if (at == 0 || !isDigitAt(line, at - 1) || !isDigitAt(line, at + 1)) return false;
  }
  return true;
}

/// What separates the cells of a line; 0 stands for runs of blanks. Where numbers have a decimal
/// comma, semicolons or tabs separate them.
char separatorOf(std::string_view line) {
  if (line.find(';') != std::string_view::npos) return ';';
  if (line.find(',') == std::string_view::npos) return 0;
  const bool tabs = line.find('\t') != std::string_view::npos;
  return tabs && commasAreDecimal(line) ? '\t' : ',';
}

std::string_view unquoted(std::string_view cell) {
  const bool quoted = cell.size() >= 2 && cell.front() == '"' && cell.back() == '"';
  return quoted ? trimmed(cell.substr(1, cell.size() - 2)) : cell;
}

/// Cells between separators, empty ones kept; or between runs of blanks.
std::vector<std::string_view> cellsOf(std::string_view line) {
  const char separator = separatorOf(line);
  const std::string_view separators =
      separator == 0 ? std::string_view(" \t") : std::string_view(&separator, 1);
  std::vector<std::string_view> cells;
  while (true) {
    const auto end = line.find_first_of(separators);
    const std::string_view cell = unquoted(trimmed(line.substr(0, end)));
    if (separator != 0 || !cell.empty()) cells.push_back(cell);
    if (end == std::string_view::npos) return cells;
    line.remove_prefix(end + 1);
  }
}

/// A number with a decimal point or a decimal comma.
std::optional<double> numberIn(std::string_view cell) {
  const auto comma = cell.find(',');
  if (comma == std::string_view::npos) return parseNumber<double>(cell);
  if (cell.find('.') != std::string_view::npos) return std::nullopt;
  std::string with_point(cell);
  with_point[comma] = '.';
  return parseNumber<double>(with_point);
}

/// Which of the two decimal marks a table has shown so far. A table with both may hold thousands
/// separators, and then "1,234" is no 1.234.
struct DecimalMarks {
  bool comma = false, point = false;
  bool note(std::string_view cell) {
    comma = comma || cell.find(',') != std::string_view::npos;
    point = point || cell.find('.') != std::string_view::npos;
    return !(comma && point);
  }
};

bool isHeader(const std::vector<std::string_view>& cells) {
  for (const std::string_view cell : cells) {
    if (numberIn(cell)) return false;
  }
  return true;
}

Result<void> appendRow(const std::vector<std::string_view>& cells, int columns,
                       const std::string& file, int line_number, DecimalMarks& marks,
                       std::vector<double>& values) {
  const std::string line = "line " + std::to_string(line_number);
  if (static_cast<int>(cells.size()) != columns) {
    return badInput(
        file, line,
        "has " + std::to_string(cells.size()) + " columns instead of " + std::to_string(columns),
        "give one row of " + std::to_string(columns) + " numbers a line");
  }
  for (int column = 0; column < columns; ++column) {
    const std::string_view cell = cells[static_cast<std::size_t>(column)];
    const auto value = numberIn(cell);
    const std::string place = line + ", column " + std::to_string(column + 1);
    if (!value) {
      return badInput(file, place, "\"" + std::string(cell.substr(0, 40)) + "\" is not a number",
                      "only the first line may be a header; # begins a comment");
    }
    if (!std::isfinite(*value)) return badInput(file, place, "the number is not finite");
    if (!marks.note(cell)) {
      return badInput(file, place, "decimal commas and decimal points are mixed",
                      "use one of the two, and nothing between thousands");
    }
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
  DecimalMarks marks;
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
    if (auto done = appendRow(cells, columns, file, line_number, marks, values); !done) {
      return done.error();
    }
  }
  if (values.empty()) return badInput(file, "", "holds no rows of numbers");
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto rows = static_cast<Eigen::Index>(values.size()) / columns;
  return Eigen::MatrixXd(Eigen::Map<const RowMajor>(values.data(), rows, columns));
}

}  // namespace tenter
