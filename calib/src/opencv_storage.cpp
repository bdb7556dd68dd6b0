// SPDX-License-Identifier: GPL-3.0-or-later
#include "opencv_storage.h"

#include <algorithm>

#include "number_list.h"
#include "tenter/core/json_reader.h"

namespace tenter {

namespace {

constexpr std::size_t kMostNumbers = 4096;

/// A matrix as the formats spell it: three texts.
struct SpelledMatrix {
  std::string rows, cols, data;
};

Result<std::optional<StoredValue>> matrixOf(const SpelledMatrix& spelled, const std::string& file,
                                            const std::string& key) {
  const auto rows = parseNumbers(spelled.rows, 1), cols = parseNumbers(spelled.cols, 1);
  const auto wrong = [&](const std::string& reason) { return badInput(file, key, reason); };
  if (!rows || !cols || rows->size() != 1 || cols->size() != 1) {
    return wrong("is a matrix without numbers of rows and columns");
  }
  const double count = rows->front() * cols->front();
  if (!(rows->front() >= 0 && cols->front() >= 0)) return wrong("has a negative size");
  if (count > static_cast<double>(kMostNumbers)) return std::optional<StoredValue>();
  const auto data = parseNumbers(spelled.data, kMostNumbers);
  if (!data) return wrong("has data that are not all finite numbers");
  if (static_cast<double>(data->size()) != count) {
    return wrong("has " + std::to_string(data->size()) + " numbers, its size says otherwise");
  }
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return std::optional(StoredValue{
      Eigen::MatrixXd(Eigen::Map<const Rows>(data->data(), static_cast<Eigen::Index>(rows->front()),
                                             static_cast<Eigen::Index>(cols->front())))});
}

void addList(const std::string& key, std::string_view text, Storage& storage) {
  const auto numbers = parseNumbers(text, kMostNumbers);
  if (!numbers || numbers->empty()) return;
  storage[key].numbers = Eigen::Map<const Eigen::RowVectorXd>(
      numbers->data(), static_cast<Eigen::Index>(numbers->size()));
}

Result<void> addMatrix(const std::string& key, const SpelledMatrix& spelled,
                       const std::string& file, Storage& storage) {
  auto matrix = matrixOf(spelled, file, key);
  if (!matrix) return matrix.error();
  if (matrix->has_value()) storage[key] = std::move(**matrix);
  return {};
}

std::string textOf(const XmlElement& parent, std::string_view name) {
  const XmlElement* found = parent.child(name);
  return found == nullptr ? "" : found->text;
}

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

/// One key of a YAML file at the line's beginning, with all that stands indented below it.
struct YamlEntry {
  std::string key, value;
  std::map<std::string, std::string> below;
};

/// Splits "key: value"; false if the line has no key.
bool splitKey(std::string_view line, std::string& key, std::string& value) {
  const auto colon = line.find(':');
  if (colon == std::string_view::npos || line.starts_with('-')) return false;
  key = trimmed(line.substr(0, colon));
  value = trimmed(line.substr(colon + 1));
  if (key.size() >= 2 && key.front() == '"' && key.back() == '"')
    key = key.substr(1, key.size() - 2);
  return true;
}

std::vector<YamlEntry> yamlEntries(std::string_view text) {
  std::vector<YamlEntry> entries;
  std::string* open = nullptr;  // a value that may go on in the next line
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const std::string_view content = trimmed(line);
    if (content.empty() || content.starts_with('#') || line.starts_with('%')) continue;
    if (line.starts_with("---") || line.starts_with("...")) continue;
    const bool in_list = open != nullptr && open->find('[') != std::string::npos &&
                         open->find(']') == std::string::npos;
    std::string key, value;
    if (in_list || !splitKey(content, key, value)) {
      if (open != nullptr) *open += " " + std::string(content);
      continue;
    }
    if (line.front() != ' ' && line.front() != '\t') {
      entries.push_back({key, value, {}});
      open = &entries.back().value;
    } else if (!entries.empty()) {
      std::string& below = entries.back().below[key];
      below = value;
      open = &below;
    }
  }
  return entries;
}

}  // namespace

Result<Storage> storageFromXml(const XmlElement& root, const std::string& file) {
  Storage storage;
  for (const XmlElement& element : root.children) {
    const bool matrix = element.child("rows") != nullptr || element.child("data") != nullptr;
    if (matrix) {
      const SpelledMatrix spelled{textOf(element, "rows"), textOf(element, "cols"),
                                  textOf(element, "data")};
      if (auto done = addMatrix(element.name, spelled, file, storage); !done) return done.error();
    } else {
      addList(element.name, element.text, storage);
    }
  }
  return storage;
}

Result<Storage> storageFromJson(std::string_view text, const std::string& file) {
  const auto document = parseJson(text, file);
  if (!document) return document.error();
  Storage storage;
  if (!document->is_object()) return badInput(file, "", "must be a JSON object");
  for (const auto& [key, value] : document->items()) {
    if (value.is_object() && value.contains("data")) {
      const auto spell = [&value = value](const char* name) {
        return value.contains(name) ? value.at(name).dump() : std::string();
      };
      const SpelledMatrix spelled{spell("rows"), spell("cols"), spell("data")};
      if (auto done = addMatrix(key, spelled, file, storage); !done) return done.error();
      continue;
    }
    // A matrix as a list of rows keeps its shape; all other lists are one row.
    const bool rows = value.is_array() && !value.empty() && value.front().is_array();
    if (value.is_number() || value.is_array()) addList(key, value.dump(), storage);
    const auto found = storage.find(key);
    if (!rows || found == storage.end()) continue;
    const auto size = static_cast<Eigen::Index>(value.size());
    const Eigen::MatrixXd flat = found->second.numbers;
    if (flat.size() % size != 0) continue;
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    found->second.numbers = Eigen::Map<const Rows>(flat.data(), size, flat.size() / size);
  }
  return storage;
}

Result<Storage> storageFromYaml(std::string_view text, const std::string& file) {
  Storage storage;
  for (const YamlEntry& entry : yamlEntries(text)) {
    const auto below = [&entry](const std::string& name) {
      const auto found = entry.below.find(name);
      return found == entry.below.end() ? std::string() : found->second;
    };
    if (entry.below.contains("data")) {
      const SpelledMatrix spelled{below("rows"), below("cols"), below("data")};
      if (auto done = addMatrix(entry.key, spelled, file, storage); !done) return done.error();
    } else {
      addList(entry.key, entry.value, storage);
    }
  }
  return storage;
}

}  // namespace tenter
