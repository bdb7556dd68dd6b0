// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/toml_document.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace tenter {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxSize_bytes = std::size_t{1} << 20;

std::string placeOf(const toml::source_position& position) {
  std::ostringstream text;
  text << "line " << position.line << ", column " << position.column;
  return text.str();
}

/// Converts nodes and remembers the first that JSON cannot hold.
class Converter {
 public:
  Json convert(const toml::node& node, const std::string& place) {
    if (const auto* table = node.as_table()) {
      Json object = Json::object();
      for (const auto& [key, value] : *table) {
        std::string inner = place;
        if (!inner.empty()) inner += '.';
        inner += key.str();
        object[std::string(key.str())] = convert(value, inner);
      }
      return object;
    }
    if (const auto* array = node.as_array()) {
      Json list = Json::array();
      for (const toml::node& element : *array) {
        list.push_back(convert(element, place + "[" + std::to_string(list.size()) + "]"));
      }
      return list;
    }
    if (const auto text = node.value_exact<std::string>()) return *text;
    if (const auto truth = node.value_exact<bool>()) return *truth;
    if (const auto whole = node.value_exact<std::int64_t>()) return *whole;
    const auto number = node.value_exact<double>();
    if (number && std::isfinite(*number)) return *number;
    if (wrong_place_.empty()) {
      wrong_place_ = place;
      reason_ = number ? "must be a finite number" : "is a date or a time";
    }
    return nullptr;
  }

  const std::string& wrongPlace() const { return wrong_place_; }
  const std::string& reason() const { return reason_; }

 private:
  std::string wrong_place_, reason_;
};

}  // namespace

Result<Json> jsonOfToml(std::string_view toml, const std::string& file) {
  if (toml.size() > kMaxSize_bytes) return badInput(file, "", "is larger than 1 MB");
  try {
    const toml::table document = toml::parse(toml);
    Converter converter;
    Json json = converter.convert(document, "");
    if (!converter.wrongPlace().empty()) {
      return badInput(file, converter.wrongPlace(), converter.reason());
    }
    return json;
  } catch (const toml::parse_error& error) {
    return badInput(file, placeOf(error.source().begin),
                    "is not valid TOML: " + std::string(error.description()));
  }
}

void onlyKnownKeys(JsonReader& in, std::initializer_list<std::string_view> keys,
                   const std::string& page) {
  if (!in.ok() || !in.json().is_object()) return;
  for (const auto& [key, value] : in.json().items()) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      in.fail(key, "is not a key here", "see " + page);
    }
  }
}

}  // namespace tenter
