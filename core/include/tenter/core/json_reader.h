// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/core/types.h"

namespace tenter {

/// Parses a JSON file with a depth limit; the error carries line and column.
Result<nlohmann::json> readJsonFile(const std::filesystem::path& file);
Result<nlohmann::json> parseJson(std::string_view text, const std::string& file,
                                 const std::string& place = "");

/// Reads fields of one JSON object and remembers the first thing that is wrong, with its path
/// ("clips[2].mass_kg"), so that a reader is written as a straight list of fields and checked once
/// at the end.
///
///   JsonReader in(json, "measurement.json");
///   m.areal_density = in.number("areal_density_kg_per_m2", Range::positive());
///   if (!in.ok()) return in.error();
class JsonReader {
 public:
  struct Range {
    double min = -1e300, max = 1e300;
    bool open_min = false;  ///< The minimum itself is refused.
    static Range any() { return {}; }
    static Range positive(double max = 1e300) { return {0.0, max, true}; }
    static Range nonNegative(double max = 1e300) { return {0.0, max, false}; }
    static Range between(double min, double max) { return {min, max, false}; }
  };

  JsonReader(const nlohmann::json& value, std::string file, std::string place = "");
  /// Shares the error slot of its parent.
  JsonReader object(const std::string& key);
  JsonReader element(const std::string& key, std::size_t index);
  std::size_t arraySize(const std::string& key);

  bool has(const std::string& key) const;
  double number(const std::string& key, Range range = Range::any());
  double numberOr(const std::string& key, double fallback, Range range = Range::any());
  std::int64_t integer(const std::string& key, std::int64_t min, std::int64_t max);
  std::string text(const std::string& key, std::size_t max_length = 4096);
  std::string textOr(const std::string& key, const std::string& fallback);
  bool boolean(const std::string& key);
  std::vector<double> numbers(const std::string& key, Range range = Range::any());
  std::vector<int> integers(const std::string& key, std::int64_t min, std::int64_t max);
  std::vector<std::string> texts(const std::string& key);
  Eigen::VectorXd vector(const std::string& key, int size);
  Eigen::MatrixXd matrix(const std::string& key, int rows,
                         int columns);  ///< rows < 0: any number of rows.

  /// Records an error found by the caller about a field of this object.
  void fail(const std::string& key, const std::string& reason, const std::string& advice = "");
  bool ok() const;
  const Error& error() const;  ///< Precondition: !ok().
  const nlohmann::json& json() const { return *value_; }

 private:
  const nlohmann::json* find(const std::string& key, bool required);
  const nlohmann::json* findArray(const std::string& key);
  std::string placeOf(const std::string& key) const;
  JsonReader child(const nlohmann::json* value, const std::string& place);
  double checkedNumber(const nlohmann::json& value, const std::string& key, const Range& range);
  std::int64_t checkedInteger(const nlohmann::json& value, const std::string& key, std::int64_t min,
                              std::int64_t max);
  std::string checkedText(const nlohmann::json& value, const std::string& key,
                          std::size_t max_length);

  const nlohmann::json* value_;
  std::string file_, place_;
  std::shared_ptr<std::optional<Error>> error_;
};

}  // namespace tenter
