// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "tenter/core/result.h"

namespace tenter {

/// Appends `json`, a tab, eight lower-case digits of its CRC-32 (zlib's) and a line end.
void appendSealed(std::string& out, std::string_view json);

/// The JSON of a line without its line end, or nothing if the CRC does not fit.
std::optional<std::string_view> unsealed(std::string_view line);

/// CRC-32 as zlib computes it, of what `before` is the CRC of and then these bytes.
std::uint32_t crc32Of(std::string_view bytes, std::uint32_t before = 0);
std::string hexadecimal(std::uint32_t value);

/// One line as it lies in the file, good or not.
struct JournalLine {
  std::uint64_t number = 0;  ///< From 1.
  std::uint64_t offset_bytes = 0;
  std::uint64_t size_bytes = 0;  ///< With its line end.
  bool has_line_end = false;
  bool good = false;     ///< The CRC fits; a last line that lacks nothing but its end is good too.
  bool has_nul = false;  ///< A bad line holds a NUL byte, as blocks that never reached the disk do.
  std::string json;      ///< Of a good line.
};

/// Cuts a stream of bytes into lines. Lines past the limit of length are bad, and not kept.
class JournalScanner {
 public:
  /// Fills a buffer and says how much; 0 is the end.
  using Source = std::function<Result<std::size_t>(char* buffer, std::size_t size)>;
  explicit JournalScanner(Source source);
  Result<std::optional<JournalLine>> next();

 private:
  Result<bool> fill();
  JournalLine take(std::size_t content_size, bool has_line_end);

  Source source_;
  std::string buffer_;
  std::size_t begin_ = 0;         ///< Of the current line in the buffer.
  std::size_t searched_ = 0;      ///< No line end before this place in the buffer.
  std::uint64_t dropped_ = 0;     ///< Bytes of the current line already thrown away.
  bool dropped_has_nul_ = false;  ///< Whether a NUL was among them.
  std::uint64_t offset_ = 0;      ///< Of the current line in the stream.
  std::uint64_t number_ = 0;
  bool ended_ = false;
};

}  // namespace tenter
