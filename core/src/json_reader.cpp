// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/json_reader.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <sstream>

#include "tenter/core/files.h"

namespace tenter {

using Json = nlohmann::json;

namespace {

constexpr std::size_t kLimit_bytes = std::size_t{1} << 28;
constexpr int kMaxDepth = 64;

std::string placeOfByte(std::string_view text, std::size_t byte, const std::string& place) {
  const std::string_view before = text.substr(0, std::min(byte, text.size()));
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const auto line_start = before.rfind('\n');
  const auto column =
      line_start == std::string_view::npos ? before.size() : before.size() - line_start - 1;
  const std::string column_text = "column " + std::to_string(std::max<std::size_t>(column, 1));
  // A caller that hands over one line of a file names that line itself.
  if (!place.empty()) return place + ", " + column_text;
  return "line " + std::to_string(line) + ", " + column_text;
}

/// First byte at which objects and arrays nest deeper than allowed; a stack overflow would come
/// later.
std::optional<std::size_t> tooDeepAt(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxDepth) return i;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return std::nullopt;
}

/// Builds the document and refuses a key that an object has twice, of which parsers keep one at
/// random.
struct DuplicateKeyFinder {
  std::vector<std::set<std::string>> keys;
  std::string duplicate, last;

  bool operator()(int /*depth*/, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) {
      keys.emplace_back();
    } else if (event == Json::parse_event_t::object_end) {
      keys.pop_back();
    } else if (event == Json::parse_event_t::key) {
      const auto& key = parsed.get_ref<const std::string&>();
      if (!keys.back().insert(key).second) duplicate = key;
      last = key;
    }
    return true;
  }
};

std::string shortNumber(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

/// What is wrong with a number, or nothing.
std::string rangeComplaint(double value, const JsonReader::Range& range) {
  const bool too_small = range.open_min ? !(value > range.min) : !(value >= range.min);
  if (too_small) {
    return "is " + shortNumber(value) + " but must be " +
           (range.open_min ? "above " : "at least ") + shortNumber(range.min);
  }
  if (!(value <= range.max)) {
    return "is " + shortNumber(value) + " but must be at most " + shortNumber(range.max);
  }
  return "";
}

const Json kNothing;

}  // namespace

Result<Json> readJsonFile(const std::filesystem::path& file) {
  const auto content = readFile(file, kLimit_bytes);
  if (!content) return content.error();
  return parseJson(*content, file.string());
}

Result<Json> parseJson(std::string_view text, const std::string& file, const std::string& place) {
  if (const auto byte = tooDeepAt(text)) {
    return badInput(file, placeOfByte(text, *byte + 1, place), "is nested too deeply");
  }
  DuplicateKeyFinder finder;
  Json document;
  try {
    document = Json::parse(text, std::ref(finder));
  } catch (const Json::parse_error& error) {
    const bool truncated = error.byte > text.size();
    return badInput(file, placeOfByte(text, error.byte, place),
                    truncated ? "the JSON ends too early" : "is not valid JSON",
                    truncated ? "the file may have been cut off; write it again" : "");
  } catch (const Json::exception&) {
    // The parser does not say where; the key that it read last does.
    const std::string separator = place.empty() || finder.last.empty() ? "" : ": ";
    return badInput(file, place + separator + finder.last,
                    "holds a number that no double can represent");
  }
  if (!finder.duplicate.empty()) {
    return badInput(file, place.empty() ? finder.duplicate : place + ": " + finder.duplicate,
                    "the key appears twice in one object", "keep one of the two");
  }
  return document;
}

JsonReader::JsonReader(const Json& value, std::string file, std::string place)
    : value_(&value),
      file_(std::move(file)),
      place_(std::move(place)),
      error_(std::make_shared<std::optional<Error>>()) {
  if (!value_->is_object()) fail("", "must be a JSON object");
}

const Json* JsonReader::find(const std::string& key, bool required) {
  const auto found = value_->is_object() ? value_->find(key) : value_->end();
  if (value_->is_object() && found != value_->end()) return &*found;
  if (required) fail(key, "is missing");
  return nullptr;
}

std::string JsonReader::placeOf(const std::string& key) const {
  if (key.empty()) return place_;
  if (place_.empty()) return key;
  // "line 3: clips[0]" reads better than "line 3.clips[0]".
  const bool bare_line = place_.starts_with("line ") && place_.find(':') == std::string::npos;
  return place_ + (bare_line ? ": " : ".") + key;
}

JsonReader JsonReader::child(const Json* value, const std::string& place) {
  JsonReader reader(*this);
  reader.value_ = value != nullptr ? value : &kNothing;
  reader.place_ = place;
  if (value != nullptr && !value->is_object()) reader.fail("", "must be a JSON object");
  return reader;
}

JsonReader JsonReader::object(const std::string& key) {
  return child(find(key, true), placeOf(key));
}

JsonReader JsonReader::element(const std::string& key, std::size_t index) {
  const std::string place = placeOf(key + "[" + std::to_string(index) + "]");
  const Json* list = find(key, true);
  if (list == nullptr || !list->is_array() || index >= list->size()) {
    if (ok()) fail(key, "has no element " + std::to_string(index));
    return child(nullptr, place);
  }
  return child(&(*list)[index], place);
}

const Json* JsonReader::findArray(const std::string& key) {
  const Json* list = find(key, true);
  if (list == nullptr || list->is_array()) return list;
  fail(key, "must be a list");
  return nullptr;
}

std::size_t JsonReader::arraySize(const std::string& key) {
  const Json* list = findArray(key);
  return list == nullptr ? 0 : list->size();
}

bool JsonReader::has(const std::string& key) const {
  return value_->is_object() && value_->contains(key);
}

double JsonReader::checkedNumber(const Json& value, const std::string& key, const Range& range) {
  if (!value.is_number()) {
    fail(key, value.is_null() ? "is null; a finite number is needed" : "must be a number");
    return 0.0;
  }
  const auto number = value.get<double>();
  if (!std::isfinite(number)) {
    fail(key, "must be a finite number");
    return 0.0;
  }
  if (const std::string complaint = rangeComplaint(number, range); !complaint.empty()) {
    fail(key, complaint, "check the unit");
    return 0.0;
  }
  return number;
}

std::int64_t JsonReader::checkedInteger(const Json& value, const std::string& key, std::int64_t min,
                                        std::int64_t max) {
  const bool too_large = value.is_number_unsigned() &&
                         value.get<std::uint64_t>() > static_cast<std::uint64_t>(INT64_MAX);
  if (!value.is_number_integer() || too_large) {
    fail(key, "must be a whole number");
    return min;
  }
  const auto number = value.get<std::int64_t>();
  if (number < min || number > max) {
    fail(key, "is " + std::to_string(number) + " but must lie between " + std::to_string(min) +
                  " and " + std::to_string(max));
    return min;
  }
  return number;
}

double JsonReader::number(const std::string& key, Range range) {
  const Json* value = find(key, true);
  return value == nullptr ? 0.0 : checkedNumber(*value, key, range);
}

double JsonReader::numberOr(const std::string& key, double fallback, Range range) {
  return has(key) ? number(key, range) : fallback;
}

std::int64_t JsonReader::integer(const std::string& key, std::int64_t min, std::int64_t max) {
  const Json* value = find(key, true);
  return value == nullptr ? min : checkedInteger(*value, key, min, max);
}

std::string JsonReader::checkedText(const Json& value, const std::string& key,
                                    std::size_t max_length) {
  if (!value.is_string()) {
    fail(key, "must be a text");
    return "";
  }
  const auto& text = value.get_ref<const std::string&>();
  if (text.size() > max_length) {
    fail(key, "is longer than " + std::to_string(max_length) + " characters");
    return "";
  }
  return text;
}

std::string JsonReader::text(const std::string& key, std::size_t max_length) {
  const Json* value = find(key, true);
  return value == nullptr ? "" : checkedText(*value, key, max_length);
}

std::string JsonReader::textOr(const std::string& key, const std::string& fallback) {
  return has(key) ? text(key) : fallback;
}

bool JsonReader::boolean(const std::string& key) {
  const Json* value = find(key, true);
  if (value == nullptr) return false;
  if (value->is_boolean()) return value->get<bool>();
  fail(key, "must be true or false");
  return false;
}

std::vector<double> JsonReader::numbers(const std::string& key, Range range) {
  std::vector<double> out;
  const Json* list = findArray(key);
  for (std::size_t i = 0; list != nullptr && i < list->size() && ok(); ++i) {
    out.push_back(checkedNumber((*list)[i], key + "[" + std::to_string(i) + "]", range));
  }
  return out;
}

std::vector<int> JsonReader::integers(const std::string& key, std::int64_t min, std::int64_t max) {
  require(min >= INT32_MIN && max <= INT32_MAX, "integers() returns 32-bit numbers");
  std::vector<int> out;
  const Json* list = findArray(key);
  for (std::size_t i = 0; list != nullptr && i < list->size() && ok(); ++i) {
    const std::string place = key + "[" + std::to_string(i) + "]";
    out.push_back(static_cast<int>(checkedInteger((*list)[i], place, min, max)));
  }
  return out;
}

std::vector<std::string> JsonReader::texts(const std::string& key) {
  std::vector<std::string> out;
  const Json* list = findArray(key);
  for (std::size_t i = 0; list != nullptr && i < list->size() && ok(); ++i) {
    out.push_back(checkedText((*list)[i], key + "[" + std::to_string(i) + "]", 4096));
  }
  return out;
}

Eigen::VectorXd JsonReader::vector(const std::string& key, int size) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(size);
  const std::vector<double> values = numbers(key);
  if (!ok()) return out;
  if (values.size() != static_cast<std::size_t>(size)) {
    fail(key,
         "has " + std::to_string(values.size()) + " numbers instead of " + std::to_string(size));
    return out;
  }
  return Eigen::Map<const Eigen::VectorXd>(values.data(), size);
}

Eigen::MatrixXd JsonReader::matrix(const std::string& key, int rows, int columns) {
  const Json* list = findArray(key);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(std::max(rows, 0), columns);
  if (list == nullptr) return out;
  if (rows >= 0 && list->size() != static_cast<std::size_t>(rows)) {
    fail(key, "has " + std::to_string(list->size()) + " rows instead of " + std::to_string(rows));
    return out;
  }
  out.setZero(static_cast<Eigen::Index>(list->size()), columns);
  for (std::size_t i = 0; i < list->size() && ok(); ++i) {
    const Json& row = (*list)[i];
    const std::string place = key + "[" + std::to_string(i) + "]";
    if (!row.is_array() || row.size() != static_cast<std::size_t>(columns)) {
      fail(place, "must be a list of " + std::to_string(columns) + " numbers");
      return out;
    }
    for (std::size_t j = 0; j < row.size(); ++j) {
      out(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          checkedNumber(row[j], place + "[" + std::to_string(j) + "]", Range::any());
    }
  }
  return out;
}

void JsonReader::fail(const std::string& key, const std::string& reason,
                      const std::string& advice) {
  if (ok()) *error_ = badInput(file_, placeOf(key), reason, advice);
}

bool JsonReader::ok() const { return !error_->has_value(); }

const Error& JsonReader::error() const {
  require(!ok(), "there is no error to read");
  return **error_;
}

}  // namespace tenter
