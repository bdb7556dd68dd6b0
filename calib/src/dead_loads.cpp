// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <span>

#include "tenter/calib/cell_calibration.h"
#include "tenter/core/files.h"

namespace tenter {
namespace {

constexpr std::size_t kMaxFile_bytes = std::size_t{4} << 20, kMaxLines = 20'000, kMaxName = 64;
constexpr double kGram_kg = 1e-3;

using Row = std::vector<std::string_view>;

std::string_view trimmed(std::string_view text) {
  const auto isBlank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && isBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && isBlank(text.back())) text.remove_suffix(1);
  return text;
}

/// Fields between commas or semicolons, without the blanks around them.
Row split(std::string_view line) {
  Row row;
  for (std::size_t begin = 0;;) {
    const std::size_t end = line.find_first_of(",;", begin);
    row.push_back(trimmed(line.substr(begin, end == line.npos ? line.npos : end - begin)));
    if (end == line.npos) return row;
    begin = end + 1;
  }
}

/// Where each column is; a column without a place is not there.
class Columns {
 public:
  explicit Columns(const Row& names) {
    for (std::size_t i = 0; i < names.size(); ++i) places_[std::string(names[i])] = i;
  }
  bool has(const std::string& name) const { return places_.count(name) != 0; }
  std::string_view of(const Row& row, const std::string& name) const {
    return row.at(places_.at(name));
  }
  /// The first name that is none of these, or "".
  std::string stranger(std::span<const std::string_view> known) const {
    for (const auto& [name, place] : places_) {
      if (std::find(known.begin(), known.end(), name) == known.end()) return name;
    }
    return "";
  }

 private:
  std::map<std::string, std::size_t> places_;
};

constexpr std::array<std::string_view, 7> kKnown{
    "cell", "mass_kg", "mass_g", "force_N", "reading_N", "sigma_N", "temperature_degC"};
constexpr std::array<std::string_view, 3> kWeights{"mass_kg", "mass_g", "force_N"};

class Table {
 public:
  Table(std::string file, const Row& names, double gravity_m_per_s2)
      : file_(std::move(file)), columns_(names), width_(names.size()) {
    for (const std::string_view weight : kWeights) {
      if (!columns_.has(std::string(weight))) continue;
      ++weights_;
      weight_ = weight;
      const double per_kg = weight == "mass_g" ? kGram_kg : 1.0;
      factor_ = weight == "force_N" ? 1.0 : per_kg * gravity_m_per_s2;
    }
  }

  Result<void> check(std::size_t line) const {
    const std::string stranger = columns_.stranger(kKnown);
    const std::string advice =
        "name the columns cell, mass_kg (or mass_g, force_N), reading_N, sigma_N, temperature_degC";
    if (!stranger.empty()) {
      return badInput(file_, place(line, ""), "there is no column \"" + stranger + "\"", advice);
    }
    if (!columns_.has("cell") || !columns_.has("reading_N") || weights_ != 1) {
      return badInput(file_, place(line, ""),
                      "needs the columns cell, reading_N and one for the weight", advice);
    }
    return {};
  }

  Result<void> take(const Row& row, std::size_t line, std::vector<CellLoads>& cells) const {
    if (row.size() != width_) {
      return badInput(
          file_, place(line, ""),
          "has " + std::to_string(row.size()) + " fields, not " + std::to_string(width_));
    }
    DeadLoad load;
    const auto weight = number(row, line, weight_);
    const auto reading = number(row, line, "reading_N");
    if (!weight) return weight.error();
    if (!reading) return reading.error();
    load.force_N = factor_ * *weight;
    load.reading_N = *reading;
    if (columns_.has("sigma_N")) {
      const auto sigma = number(row, line, "sigma_N");
      if (!sigma) return sigma.error();
      if (*sigma < 0.0) return badInput(file_, place(line, "sigma_N"), "must not be negative");
      load.sigma_N = *sigma;
    }
    if (columns_.has("temperature_degC") && !columns_.of(row, "temperature_degC").empty()) {
      const auto temperature = number(row, line, "temperature_degC");
      if (!temperature) return temperature.error();
      load.temperature_degC = *temperature;
    }
    const std::string name(columns_.of(row, "cell"));
    if (name.empty() || name.size() > kMaxName) {
      return badInput(file_, place(line, "cell"), "must have 1 to 64 characters");
    }
    auto cell = std::find_if(cells.begin(), cells.end(),
                             [&](const CellLoads& known) { return known.cell == name; });
    if (cell == cells.end()) cell = cells.insert(cells.end(), {name, {}});
    cell->loads.push_back(load);
    return {};
  }

 private:
  static std::string place(std::size_t line, const std::string& column) {
    return "line " + std::to_string(line) + (column.empty() ? "" : ", " + column);
  }
  Result<double> number(const Row& row, std::size_t line, const std::string& column) const {
    const std::string_view text = columns_.of(row, column);
    double value = 0.0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
    constexpr double kMost = 1e6;
    if (read.ec != std::errc() || read.ptr != text.data() + text.size() ||
        !(std::abs(value) <= kMost)) {
      return badInput(file_, place(line, column), "is no number that can be");
    }
    return value;
  }

  std::string file_;
  Columns columns_;
  std::size_t width_;
  int weights_ = 0;
  std::string weight_;
  double factor_ = 1.0;
};

}  // namespace

Result<std::vector<CellLoads>> readDeadLoads(const std::filesystem::path& file,
                                             double gravity_m_per_s2) {
  const auto text = readFile(file, kMaxFile_bytes);
  if (!text) return text.error();
  std::vector<CellLoads> cells;
  std::optional<Table> table;
  std::string_view rest = *text;
  for (std::size_t line = 1; !rest.empty(); ++line) {
    if (line > kMaxLines) return badInput(file.string(), "", "has too many lines");
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view content = trimmed(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (content.empty() || content.front() == '#') continue;
    const Row row = split(content);
    if (!table) {
      table.emplace(file.string(), row, gravity_m_per_s2);
      if (auto good = table->check(line); !good) return good.error();
      continue;
    }
    if (auto taken = table->take(row, line, cells); !taken) return taken.error();
  }
  if (cells.empty()) return badInput(file.string(), "", "has no weights in it");
  return cells;
}

}  // namespace tenter
