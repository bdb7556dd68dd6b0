// SPDX-License-Identifier: GPL-3.0-or-later
#include "kes_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "import_table.h"
#include "tenter/core/files.h"

namespace tenter {
namespace {

using import::shown;

constexpr std::size_t kMaxBytes = std::size_t{1} << 24;
constexpr std::size_t kMaxFabrics = 1000;
constexpr std::size_t kShownLetters = 40;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::string_view kBlanks = " \t\r";

/// What a table must hold, its unit, and the values that cloth can have.
struct Property {
  std::string_view name, unit;
  bool required;
  double min, max;
};
constexpr Property kProperties[] = {
    {"EMT", "%", true, 0.05, 200.0},        {"LT", "-", true, 0.51, 1.5},
    {"WT", "gf.cm/cm2", false, 0.0, 1e4},   {"RT", "%", false, 0.0, 120.0},
    {"B", "gf.cm2/cm", true, 1e-4, 100.0},  {"2HB", "gf.cm/cm", false, 0.0, 100.0},
    {"G", "gf/cm/deg", true, 1e-3, 1000.0}, {"2HG", "gf/cm", false, 0.0, 1000.0},
    {"2HG5", "gf/cm", false, 0.0, 1000.0},
};

/// A line of the file, and its number from 1.
struct Line {
  int number = 0;
  std::vector<std::string> cells;
  std::string place() const { return "line " + std::to_string(number); }
};

std::string lowered(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

std::string quoted(const std::string& text) { return "\"" + text.substr(0, kShownLetters) + "\""; }

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

/// A unit without the dots, carets, blanks and superscripts in which spellings differ.
std::string plainUnit(std::string unit) {
  constexpr std::string_view kDegree = "\xC2\xB0", kSquared = "\xC2\xB2", kMiddleDot = "\xC2\xB7";
  unit = replaced(std::move(unit), kDegree, "deg");
  unit = replaced(std::move(unit), kSquared, "2");
  unit = replaced(std::move(unit), kMiddleDot, "");
  unit = lowered(std::move(unit));
  std::erase_if(unit, [](char c) { return c == '.' || c == '*' || c == '^' || c == ' '; });
  return unit == "none" || unit == "1" ? "-" : unit;
}

bool sameUnit(const std::string& unit, std::string_view expected) {
  const std::string plain = plainUnit(unit);
  return plain == plainUnit(std::string(expected)) || (plain.empty() && expected == "-");
}

/// Semicolons or tabs where the first line of the table has one: numbers may then hold commas.
char separatorOf(std::string_view line) {
  for (const char separator : {';', '\t'})
    if (line.find(separator) != std::string_view::npos) return separator;
  return ',';
}

std::string trimmed(std::string_view cell, char separator) {
  const std::string_view blanks = separator == '\t' ? std::string_view(" \r") : kBlanks;
  const auto first = cell.find_first_not_of(blanks);
  if (first == std::string_view::npos) return "";
  cell = cell.substr(first, cell.find_last_not_of(blanks) - first + 1);
  const bool in_quotes = cell.size() >= 2 && cell.front() == '"' && cell.back() == '"';
  return std::string(in_quotes ? cell.substr(1, cell.size() - 2) : cell);
}

std::vector<std::string> cellsOf(std::string_view line, char separator) {
  std::vector<std::string> cells;
  while (true) {
    const auto end = line.find(separator);
    cells.push_back(trimmed(line.substr(0, end), separator));
    if (end == std::string_view::npos) return cells;
    line.remove_prefix(end + 1);
  }
}

std::vector<Line> linesOf(std::string_view content) {
  std::vector<Line> lines;
  char separator = 0;
  if (content.starts_with(kByteOrderMark)) content.remove_prefix(kByteOrderMark.size());
  for (int number = 1; !content.empty(); ++number) {
    const auto end = content.find('\n');
    const std::string_view line = content.substr(0, end);
    content.remove_prefix(end == std::string_view::npos ? content.size() : end + 1);
    const auto first = line.find_first_not_of(kBlanks);
    if (first == std::string_view::npos || line[first] == '#') continue;
    if (separator == 0) separator = separatorOf(line);
    lines.push_back({number, cellsOf(line, separator)});
  }
  return lines;
}

const Property* findProperty(const std::string& name) {
  for (const Property& property : kProperties)
    if (lowered(std::string(property.name)) == lowered(name)) return &property;
  return nullptr;
}

bool nameIsSafe(const std::string& name) {
  const bool letters = name.find_first_not_of(
                           "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                           "0123456789_-. ") == std::string::npos;
  return letters && !name.empty() && name.size() <= 64 && name.front() != '.';
}

/// Fills a table cell by cell, whichever way it is laid out.
class Filler {
 public:
  explicit Filler(std::string file) { table_.file = std::move(file); }

  Result<void> addFabric(const std::string& name, const std::string& place) {
    if (table_.fabrics.size() >= kMaxFabrics) return fail(place, "has too many fabrics");
    if (!nameIsSafe(name))
      return fail(place, quoted(name) + " cannot name a fabric", "use letters, digits, - and _");
    if (std::find(table_.fabrics.begin(), table_.fabrics.end(), name) != table_.fabrics.end())
      return fail(place, "the fabric " + name + " appears twice");
    table_.fabrics.push_back(name);
    table_.results.emplace_back();
    return {};
  }

  Result<void> checkUnit(const Property& property, const std::string& unit,
                         const std::string& place) const {
    if (sameUnit(unit, property.unit)) return {};
    return fail(place,
                std::string(property.name) + " is in " + quoted(unit) + " but must be in \"" +
                    std::string(property.unit) + "\"",
                "only the units of the KES-FB instruments are read");
  }

  Result<void> addValue(std::size_t fabric, const Property& property, const std::string& cell,
                        const std::string& place) {
    const std::string at = place + ", fabric " + table_.fabrics[fabric];
    const auto value = number(cell, at);
    if (!value) return value.error();
    if (*value < property.min || *value > property.max)
      return fail(at,
                  std::string(property.name) + " is " + shown(*value) + ", outside " +
                      shown(property.min) + " to " + shown(property.max) + " " +
                      std::string(property.unit),
                  "check the unit");
    if (!table_.results[fabric].emplace(std::string(property.name), *value).second)
      return fail(place, std::string(property.name) + " appears twice");
    return {};
  }

  Result<KesTable> finish() {
    if (table_.fabrics.empty()) return fail("", "holds no fabric");
    for (const Property& property : kProperties)
      if (property.required && !table_.results.front().contains(property.name))
        return fail("", std::string(property.name) + " is missing", "EMT, LT, G and B are needed");
    return std::move(table_);
  }

  Error fail(const std::string& place, const std::string& reason,
             const std::string& advice = "") const {
    return badInput(table_.file, place, reason, advice);
  }

 private:
  Result<double> number(std::string cell, const std::string& place) {
    const auto comma = cell.find(',');
    commas_ = commas_ || comma != std::string::npos;
    points_ = points_ || cell.find('.') != std::string::npos;
    if (commas_ && points_)
      return fail(place, "decimal commas and decimal points are mixed",
                  "use one of the two, and nothing between thousands");
    const std::string as_given = cell;
    if (comma != std::string::npos) cell[comma] = '.';
    double value = 0.0;
    const auto [end, code] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (code != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value))
      return fail(place, quoted(as_given) + " is not a finite number");
    return value;
  }

  KesTable table_;
  bool commas_ = false, points_ = false;
};

Result<void> checkWidth(const Line& line, std::size_t columns, const Filler& filler) {
  if (line.cells.size() == columns) return {};
  return filler.fail(line.place(), "has " + std::to_string(line.cells.size()) +
                                       " columns instead of " + std::to_string(columns));
}

/// property, unit, one column a fabric.
Result<void> fillFromColumns(const std::vector<Line>& lines, Filler& filler) {
  const Line& header = lines.front();
  const std::size_t columns = header.cells.size();
  for (std::size_t i = 2; i < columns; ++i)
    if (auto ok = filler.addFabric(header.cells[i], header.place()); !ok) return ok;
  for (std::size_t l = 1; l < lines.size(); ++l) {
    const Line& line = lines[l];
    const Property* property = findProperty(line.cells.front());
    if (property == nullptr) continue;  // tables hold more than a material needs
    if (auto ok = checkWidth(line, columns, filler); !ok) return ok;
    if (auto ok = filler.checkUnit(*property, line.cells[1], line.place()); !ok) return ok;
    for (std::size_t i = 2; i < columns; ++i)
      if (auto ok = filler.addValue(i - 2, *property, line.cells[i], line.place()); !ok) return ok;
  }
  return {};
}

/// A line of properties, a line of units, one line a fabric.
Result<void> fillFromRows(const std::vector<Line>& lines, Filler& filler) {
  const std::size_t columns = lines.front().cells.size();
  if (lines.size() < 2) return {};
  if (auto ok = checkWidth(lines[1], columns, filler); !ok) return ok;
  std::vector<const Property*> properties(columns, nullptr);
  for (std::size_t i = 1; i < columns; ++i) {
    properties[i] = findProperty(lines.front().cells[i]);
    if (properties[i] == nullptr) continue;
    if (auto ok = filler.checkUnit(*properties[i], lines[1].cells[i], lines[1].place()); !ok)
      return ok;
  }
  for (std::size_t l = 2; l < lines.size(); ++l) {
    const Line& line = lines[l];
    if (auto ok = checkWidth(line, columns, filler); !ok) return ok;
    if (auto ok = filler.addFabric(line.cells.front(), line.place()); !ok) return ok;
    for (std::size_t i = 1; i < columns; ++i) {
      if (properties[i] == nullptr) continue;
      if (auto ok = filler.addValue(l - 2, *properties[i], line.cells[i], line.place()); !ok)
        return ok;
    }
  }
  return {};
}

}  // namespace

Result<KesTable> readKesTable(const std::filesystem::path& csv) {
  const auto content = readFile(csv, kMaxBytes);
  if (!content) return content.error();
  const std::vector<Line> lines = linesOf(*content);
  Filler filler(csv.string());
  if (lines.empty()) return filler.fail("", "holds no KES table");
  const std::vector<std::string>& head = lines.front().cells;
  const std::string first = lowered(head.front());
  Result<void> filled;
  if (head.size() >= 3 && first == "property" && lowered(head[1]) == "unit") {
    filled = fillFromColumns(lines, filler);
  } else if (head.size() >= 2 && first == "fabric") {
    filled = fillFromRows(lines, filler);
  } else {
    return filler.fail(lines.front().place(), "is not the header of a KES table",
                       "begin with: property,unit, and one column a fabric; or with: fabric, one "
                       "column a property, and a second line of units");
  }
  if (!filled) return filled.error();
  return filler.finish();
}

}  // namespace tenter
