// SPDX-License-Identifier: GPL-3.0-or-later
#include "journal_line.h"

#include <zlib.h>

#include <charconv>

#include "session_format.h"

namespace tenter {

namespace {

constexpr std::size_t kCrcDigits = 8;
constexpr std::size_t kBlock_bytes = std::size_t{1} << 16;

/// Eight lower-case digits or nothing: another spelling of the same number is damage too.
std::optional<std::uint32_t> parseCrc(std::string_view digits) {
  std::uint32_t value = 0;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  if (error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  if (hexadecimal(value) != digits) return std::nullopt;
  return value;
}

}  // namespace

std::uint32_t crc32Of(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

std::string hexadecimal(std::uint32_t value) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text(kCrcDigits, '0');
  for (std::size_t i = kCrcDigits; i-- > 0; value >>= 4U) text[i] = kDigits[value & 15U];
  return text;
}

void appendSealed(std::string& out, std::string_view json) {
  out += json;
  out += '\t';
  out += hexadecimal(crc32Of(json));
  out += '\n';
}

std::optional<std::string_view> unsealed(std::string_view line) {
  if (line.size() < kCrcDigits + 1 || line[line.size() - kCrcDigits - 1] != '\t') {
    return std::nullopt;
  }
  const std::string_view json = line.substr(0, line.size() - kCrcDigits - 1);
  const auto crc = parseCrc(line.substr(line.size() - kCrcDigits));
  // An empty text has the CRC 0: not a record.
  if (!crc || json.empty() || *crc != crc32Of(json)) return std::nullopt;
  return json;
}

JournalScanner::JournalScanner(Source source) : source_(std::move(source)) {}

Result<bool> JournalScanner::fill() {
  buffer_.erase(0, begin_);
  searched_ -= begin_;
  begin_ = 0;
  if (buffer_.size() > session_format::kMaxLine_bytes) {
    dropped_ += buffer_.size();
    dropped_has_nul_ = dropped_has_nul_ || buffer_.find('\0') != std::string::npos;
    buffer_.clear();
    searched_ = 0;
  }
  const std::size_t kept = buffer_.size();
  buffer_.resize(kept + kBlock_bytes);
  const auto count = source_(buffer_.data() + kept, kBlock_bytes);
  buffer_.resize(kept + (count.ok() ? *count : 0));
  if (!count) return count.error();
  return *count > 0;
}

JournalLine JournalScanner::take(std::size_t content_size, bool has_line_end) {
  const std::string_view content = std::string_view(buffer_).substr(begin_, content_size);
  const std::size_t in_buffer = content_size + (has_line_end ? 1 : 0);
  JournalLine line;
  line.number = ++number_;
  line.offset_bytes = offset_;
  line.size_bytes = dropped_ + in_buffer;
  line.has_line_end = has_line_end;
  if (dropped_ == 0 && line.size_bytes <= session_format::kMaxLine_bytes) {
    if (const auto json = unsealed(content)) {
      line.good = true;
      line.json = *json;
    }
  }
  line.has_nul = !line.good && (dropped_has_nul_ || content.find('\0') != std::string_view::npos);
  offset_ += line.size_bytes;
  begin_ += in_buffer;
  searched_ = begin_;
  dropped_ = 0;
  dropped_has_nul_ = false;
  return line;
}

Result<std::optional<JournalLine>> JournalScanner::next() {
  while (true) {
    const std::size_t line_end = buffer_.find('\n', searched_);
    if (line_end != std::string::npos) return std::optional(take(line_end - begin_, true));
    searched_ = buffer_.size();
    if (!ended_) {
      const auto more = fill();
      if (!more) return more.error();
      ended_ = !*more;
      continue;
    }
    if (buffer_.size() == begin_ && dropped_ == 0) return std::optional<JournalLine>();
    return std::optional(take(buffer_.size() - begin_, false));
  }
}

}  // namespace tenter
