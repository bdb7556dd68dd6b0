// SPDX-License-Identifier: GPL-3.0-or-later
#include "ply_source.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

#include "text_scan.h"

namespace tenter {

namespace {

static_assert(std::endian::native == std::endian::little, "binary PLY is swapped on this premise");

constexpr std::int64_t kMaxItems = 100'000'000;
constexpr std::size_t kMaxProperties = 256;
constexpr int kMaxHeaderLines = 10'000;

constexpr std::array<std::pair<std::string_view, PlyType>, 16> kTypeNames{
    {{"char", PlyType::kInt8},
     {"int8", PlyType::kInt8},
     {"uchar", PlyType::kUint8},
     {"uint8", PlyType::kUint8},
     {"short", PlyType::kInt16},
     {"int16", PlyType::kInt16},
     {"ushort", PlyType::kUint16},
     {"uint16", PlyType::kUint16},
     {"int", PlyType::kInt32},
     {"int32", PlyType::kInt32},
     {"uint", PlyType::kUint32},
     {"uint32", PlyType::kUint32},
     {"float", PlyType::kFloat32},
     {"float32", PlyType::kFloat32},
     {"double", PlyType::kFloat64},
     {"float64", PlyType::kFloat64}}};

std::optional<PlyType> typeNamed(std::string_view name) {
  for (const auto& [known, type] : kTypeNames) {
    if (known == name) return type;
  }
  return std::nullopt;
}

std::optional<PlyEncoding> encodingNamed(std::string_view name) {
  if (name == "ascii") return PlyEncoding::kAscii;
  if (name == "binary_little_endian") return PlyEncoding::kLittleEndian;
  if (name == "binary_big_endian") return PlyEncoding::kBigEndian;
  return std::nullopt;
}

/// What is wrong with one header line, or an empty text.
std::string readElementLine(std::string_view line, PlyHeader& header) {
  PlyElement element;
  element.name = nextWord(line);
  const auto count = parseNumber<std::int64_t>(nextWord(line));
  if (element.name.empty() || !count || *count < 0) return "needs a name and a count";
  for (const PlyElement& other : header.elements) {
    if (other.name == element.name) return "repeats a name";
  }
  if (*count > kMaxItems) return "announces more than 100 million items";
  element.count = *count;
  header.elements.push_back(std::move(element));
  return "";
}

std::string readPropertyLine(std::string_view line, PlyHeader& header) {
  if (header.elements.empty()) return "comes before any element";
  PlyElement& element = header.elements.back();
  PlyProperty property;
  std::string_view word = nextWord(line);
  if (word == "list") {
    property.count_type = typeNamed(nextWord(line));
    if (!property.count_type) return "has an unknown type of count";
    word = nextWord(line);
  }
  const auto type = typeNamed(word);
  if (!type) return "has an unknown type";
  property.type = *type;
  property.name = nextWord(line);
  if (property.name.empty()) return "has no name";
  for (const PlyProperty& other : element.properties) {
    if (other.name == property.name) return "repeats a name";
  }
  if (element.properties.size() >= kMaxProperties) return "is one of too many";
  element.properties.push_back(std::move(property));
  return "";
}

template <class T>
double valueOf(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

std::size_t sizeOf(PlyType type) {
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

double decoded(const char* bytes, PlyType type) {
  constexpr std::array<double (*)(const char*), 8> kDecoders{
      &valueOf<std::int8_t>,   &valueOf<std::uint8_t>, &valueOf<std::int16_t>,
      &valueOf<std::uint16_t>, &valueOf<std::int32_t>, &valueOf<std::uint32_t>,
      &valueOf<float>,         &valueOf<double>};
  return kDecoders[static_cast<std::size_t>(type)](bytes);
}

}  // namespace

Result<PlyHeader> takePlyHeader(std::string_view& content, const std::string& file) {
  PlyHeader header;
  if (nextLine(content) != "ply") return badInput(file, "line 1", "does not say \"ply\"");
  bool has_format = false;
  for (int number = 2; number < kMaxHeaderLines && !content.empty(); ++number) {
    std::string_view line = nextLine(content);
    const std::string_view keyword = nextWord(line);
    std::string complaint;
    if (keyword == "end_header") {
      if (has_format) return header;
      complaint = "ends a header without a format";
    } else if (keyword == "format") {
      const auto encoding = encodingNamed(nextWord(line));
      has_format = encoding.has_value();
      if (!has_format) complaint = "names an unknown format";
      header.encoding = encoding.value_or(PlyEncoding::kAscii);
    } else if (keyword == "element") {
      complaint = readElementLine(line, header);
    } else if (keyword == "property") {
      complaint = readPropertyLine(line, header);
    } else if (keyword != "comment" && keyword != "obj_info") {
      complaint = "begins with an unknown word";
    }
    if (!complaint.empty()) return badInput(file, "line " + std::to_string(number), complaint);
  }
  return badInput(file, "header", "has no end", "the file may be cut off");
}

std::optional<double> PlySource::next(PlyType type) {
  if (encoding_ == PlyEncoding::kAscii) return parseNumber<double>(nextWord(content_));
  const std::size_t size = sizeOf(type);
  if (content_.size() < size) return std::nullopt;
  std::array<char, 8> bytes{};
  std::copy_n(content_.begin(), size, bytes.begin());
  if (encoding_ == PlyEncoding::kBigEndian) std::reverse(bytes.begin(), bytes.begin() + size);
  content_.remove_prefix(size);
  return decoded(bytes.data(), type);
}

}  // namespace tenter
