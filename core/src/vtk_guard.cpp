// SPDX-License-Identifier: GPL-3.0-or-later
#include "vtk_guard.h"

#include <algorithm>
#include <cstdint>
#include <optional>

#include "text_scan.h"

namespace tenter {

namespace {

/// zlib packs at most 1032 to 1, so a file cannot hold more items than this a byte.
constexpr std::size_t kMaxItemsPerByte = 1100;
constexpr std::string_view kBlanks = " \t\r\n";
constexpr std::size_t kHeaderWords = 3;  // blocks, bytes of a block, bytes of the last if shorter

void skipBlanks(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
}

/// The value that begins at `text`, after the attribute's name: = and a quoted text, blanks
/// between; nothing where it is no attribute (names of arrays may begin like one).
std::optional<std::string_view> attributeValue(std::string_view text) {
  skipBlanks(text);
  if (!text.starts_with('=')) return std::nullopt;
  text.remove_prefix(1);
  skipBlanks(text);
  if (text.empty() || (text.front() != '"' && text.front() != '\'')) return std::nullopt;
  const auto end = text.find(text.front(), 1);
  if (end == std::string_view::npos) return std::nullopt;
  return text.substr(1, end - 1);
}

/// An attribute of a tag; empty if it has none of that name.
std::string_view attribute(std::string_view tag, std::string_view name) {
  for (auto at = tag.find(name); at != std::string_view::npos; at = tag.find(name, at + 1)) {
    const bool whole = at > 0 && kBlanks.find(tag[at - 1]) != std::string_view::npos;
    const auto value = attributeValue(tag.substr(at + name.size()));
    if (whole && value) return *value;
  }
  return {};
}

Result<void> checkCounts(std::string_view content, const std::string& file) {
  constexpr std::string_view kAttribute = "NumberOf";
  const std::size_t limit = content.size() * kMaxItemsPerByte;
  for (auto at = content.find(kAttribute); at != std::string_view::npos;
       at = content.find(kAttribute, at + 1)) {
    std::string_view rest = content.substr(at);
    const std::string name(
        rest.substr(0, std::min(rest.find_first_of("= \"'\t\r\n<>"), rest.size())));
    rest.remove_prefix(name.size());
    const auto value = attributeValue(rest);
    if (!value) continue;
    const auto count = parseNumber<std::uint64_t>(*value);
    if (count && *count <= limit) continue;
    return badInput(file, name.substr(0, 60), "is no count, or more than the file can hold");
  }
  return {};
}

int base64Digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/// The first bytes of base64 text, as many as there are up to `size`.
std::string decodedBase64(std::string_view text, std::size_t size) {
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int digit = base64Digit(c);
    if (digit < 0 || bytes.size() == size) break;
    bits = bits << 6U | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> static_cast<unsigned>(count) & 0xFFU);
  }
  return bytes;
}

/// How a file packs its arrays.
struct Packing {
  bool big_endian = false;
  std::size_t word_bytes = 4;
  bool appended_raw = false;
  std::string_view appended;  ///< From the first byte after the underscore.

  std::uint64_t word(std::string_view bytes, std::size_t index) const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < word_bytes; ++i) {
      const std::size_t place = big_endian ? i : word_bytes - 1 - i;
      value = value << 8U | static_cast<std::uint8_t>(bytes[index * word_bytes + place]);
    }
    return value;
  }
};

std::string_view tagAt(std::string_view content, std::size_t at) {
  return content.substr(at, std::min(content.find('>', at), content.size()) - at);
}

Packing packingOf(std::string_view content, std::string_view file_tag) {
  Packing packing;
  packing.big_endian = attribute(file_tag, "byte_order") == "BigEndian";
  packing.word_bytes = attribute(file_tag, "header_type") == "UInt64" ? 8 : 4;
  const auto at = content.find("<AppendedData");
  if (at == std::string_view::npos) return packing;
  const std::string_view tag = tagAt(content, at);
  packing.appended_raw = attribute(tag, "encoding") == "raw";
  packing.appended = content.substr(at + tag.size());
  const auto start = packing.appended.find('_');
  packing.appended.remove_prefix(std::min(start, packing.appended.size() - 1) + 1);
  return packing;
}

/// Where the data of an array begin, if they are packed.
std::optional<std::string_view> dataOf(const Packing& packing, std::string_view tag,
                                       std::string_view after) {
  const std::string_view format = attribute(tag, "format");
  if (format == "binary") {
    after.remove_prefix(std::min<std::size_t>(1, after.size()));  // the tag's own bracket
    skipBlanks(after);
    return after;
  }
  if (format != "appended") return std::nullopt;
  const auto offset = parseNumber<std::uint64_t>(attribute(tag, "offset")).value_or(0);
  return packing.appended.substr(std::min<std::uint64_t>(offset, packing.appended.size()));
}

/// Whether packed data begin with a whole header, and one that the file can hold: three words, then
/// the packed size of every block.
bool headerIsSound(const Packing& packing, bool raw, std::string_view data,
                   std::size_t file_bytes) {
  const auto first = [&](std::size_t words) {
    const std::size_t size = words * packing.word_bytes;
    return raw ? std::string(data.substr(0, size)) : decodedBase64(data, size);
  };
  const std::string header = first(kHeaderWords);
  if (header.size() < kHeaderWords * packing.word_bytes) return false;
  const std::uint64_t blocks = packing.word(header, 0), block_bytes = packing.word(header, 1),
                      last_bytes = packing.word(header, 2);
  if (blocks == 0) return last_bytes == 0;
  const std::uint64_t limit = file_bytes * kMaxItemsPerByte;
  const bool possible = block_bytes > 0 && block_bytes <= limit && blocks <= limit / block_bytes &&
                        last_bytes <= block_bytes && blocks <= file_bytes;
  if (!possible) return false;
  const std::string sizes = first(kHeaderWords + blocks);
  if (sizes.size() < (kHeaderWords + blocks) * packing.word_bytes) return false;
  for (std::size_t i = 0; i < blocks; ++i) {
    if (packing.word(sizes, kHeaderWords + i) > file_bytes) return false;
  }
  return true;
}

/// Every array's tag: no text, no bracket inside quotes (VTK and XML take the tag to end
/// differently there), and blocks that can be.
Result<void> checkArrays(std::string_view content, const std::string& file) {
  const auto file_at = content.find("<VTKFile");
  if (file_at == std::string_view::npos) return {};
  const std::string_view file_tag = tagAt(content, file_at);
  const bool packed = !attribute(file_tag, "compressor").empty();
  const Packing packing = packingOf(content, file_tag);
  for (const std::string_view element : {"<DataArray", "<Array"}) {
    for (auto at = content.find(element); at != std::string_view::npos;
         at = content.find(element, at + 1)) {
      const std::string_view tag = tagAt(content, at);
      if (at + tag.size() == content.size()) break;  // cut off, as VTK will say
      const std::string place =
          "array \"" + std::string(attribute(tag, "Name").substr(0, 60)) + "\"";
      if (std::count(tag.begin(), tag.end(), '"') % 2 != 0 ||
          std::count(tag.begin(), tag.end(), '\'') % 2 != 0) {
        return badInput(file, place, "has an attribute that does not end");
      }
      if (attribute(tag, "type") == "String") {
        return badInput(file, place, "holds text, which is not read",
                        "save the mesh with numeric arrays alone");
      }
      if (!packed) continue;
      const auto data = dataOf(packing, tag, content.substr(at + tag.size()));
      const bool raw = packing.appended_raw && attribute(tag, "format") == "appended";
      if (data && !headerIsSound(packing, raw, *data, content.size())) {
        return badInput(file, place, "the header of its compressed blocks is damaged",
                        "write the file again");
      }
    }
  }
  return {};
}

}  // namespace

Result<void> checkVtkXml(std::string_view content, const std::string& file) {
  for (const std::string_view entity : {"<!DOCTYPE", "<!ENTITY", "&#"}) {
    // Raw appended data may hold any bytes; what is before it may not.
    const auto at = content.substr(0, content.find("<AppendedData")).find(entity);
    if (at == std::string_view::npos) continue;
    return badInput(file, "byte " + std::to_string(at), "XML entities are not read");
  }
  if (auto done = checkCounts(content, file); !done) return done;
  return checkArrays(content, file);
}

}  // namespace tenter
