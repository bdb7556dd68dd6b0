// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <charconv>
#include <string_view>

#include "session_format.h"
#include "tenter/session/session_header.h"

namespace tenter {

namespace {

using std::chrono::nanoseconds;
using std::chrono::sys_days;
using std::chrono::sys_time;

constexpr std::size_t kSeconds_chars = 19;  // "2026-11-24T20:49:49"

std::optional<int> digits(std::string_view text) {
  int value = 0;
  if (!std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; })) {
    return std::nullopt;
  }
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

/// ".5" and the like, or "", in nanoseconds.
std::optional<int> fraction(std::string_view text) {
  if (text.empty()) return 0;
  if (text[0] != '.' || text.size() < 2 || text.size() > 10) return std::nullopt;
  std::string padded(text.substr(1));
  padded.resize(9, '0');
  return digits(padded);
}

}  // namespace

std::string utcStamp(std::chrono::system_clock::time_point time) {
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(std::chrono::duration_cast<nanoseconds>(time - day));
  const auto text = [](auto number, std::size_t width) {
    return session_format::padded(static_cast<std::uint64_t>(number), width);
  };
  return text(static_cast<int>(date.year()), 4) + "-" +
         text(static_cast<unsigned>(date.month()), 2) + "-" +
         text(static_cast<unsigned>(date.day()), 2) + "T" + text(clock.hours().count(), 2) + ":" +
         text(clock.minutes().count(), 2) + ":" + text(clock.seconds().count(), 2) + "." +
         text(clock.subseconds().count(), 9) + "Z";
}

std::optional<std::int64_t> parseUtcStamp(const std::string& stamp) {
  const std::string_view text = stamp;
  if (text.size() < kSeconds_chars + 1 || text.back() != 'Z' || text[4] != '-' || text[7] != '-' ||
      text[10] != 'T' || text[13] != ':' || text[16] != ':') {
    return std::nullopt;
  }
  const auto year = digits(text.substr(0, 4)), month = digits(text.substr(5, 2)),
             day = digits(text.substr(8, 2)), hour = digits(text.substr(11, 2)),
             minute = digits(text.substr(14, 2)), second = digits(text.substr(17, 2)),
             part = fraction(text.substr(kSeconds_chars, text.size() - kSeconds_chars - 1));
  if (!year || !month || !day || !hour || !minute || !second || !part) return std::nullopt;
  const std::chrono::year_month_day date(std::chrono::year(*year),
                                         std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day)));
  // Nanoseconds since 1970 in 64 bits reach to 2262.
  const bool possible =
      date.ok() && *year >= 1970 && *year <= 2261 && *hour < 24 && *minute < 60 && *second < 60;
  if (!possible) return std::nullopt;
  const sys_time<nanoseconds> time = sys_days(date) + std::chrono::hours(*hour) +
                                     std::chrono::minutes(*minute) + std::chrono::seconds(*second) +
                                     nanoseconds(*part);
  return time.time_since_epoch().count();
}

}  // namespace tenter
