// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace tenter::session_format {

inline constexpr const char* kFormat = "tenter-session";
inline constexpr const char* kUnits = "SI";
inline constexpr const char* kHeaderFile = "session.json";
inline constexpr const char* kJournalFile = "journal.jsonl";
inline constexpr const char* kFramesFolder = "frames";
inline constexpr const char* kRepairsFolder = "repairs";
inline constexpr const char* kReportFile = "report.json";
inline constexpr const char* kTailFile = "tail.bin";
inline constexpr const char* kPartSuffix = ".part";

inline constexpr const char* kBegin = "begin";
inline constexpr const char* kResumed = "resumed";
inline constexpr const char* kClosed = "closed";
inline constexpr const char* kRest = "rest";  ///< Kind of record.

inline constexpr std::size_t kMaxName = 200;
inline constexpr std::size_t kMaxText = 4096;
inline constexpr std::size_t kMaxDocument_bytes = std::size_t{1} << 22;
inline constexpr std::size_t kMaxChannels = 256;
inline constexpr std::size_t kMaxFrameFiles = 256;
inline constexpr std::size_t kMaxLine_bytes = std::size_t{1} << 20;
/// Whole numbers up to 2^53 survive readers that know doubles alone; 104 days in nanoseconds.
inline constexpr std::int64_t kMaxInteger = std::int64_t{1} << 53;

inline bool isLowerOrDigit(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); }
inline bool isNameCharacter(char c) {
  return isLowerOrDigit(c) || (c >= 'A' && c <= 'Z') || c == '_' || c == '-';
}

/// "frames/000012-left.png": nothing else may name a file, lest a journal point out of its session.
bool isFrameFileName(std::string_view name);
/// "rest/left.png".
bool isRestFileName(std::string_view name);
/// Parts of such a name.
bool isCameraName(std::string_view name);
bool isExtension(std::string_view name);
std::string frameFileName(std::int64_t frame, std::string_view camera, std::string_view extension);

/// `number` with leading zeros.
std::string padded(std::uint64_t number, std::size_t digits);

}  // namespace tenter::session_format
