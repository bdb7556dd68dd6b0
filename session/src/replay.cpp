// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/session/replay.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "record_codec.h"
#include "tenter/session/session_reader.h"

namespace tenter {

namespace {

using Clock = std::chrono::steady_clock;

/// So that an interrupt is answered soon, however long the next record is away.
constexpr std::chrono::milliseconds kLongestSleep{50};

/// Holds records back until their time has come.
class Pace {
 public:
  Pace(double speed, const std::function<bool()>& interrupted)
      : speed_(speed), interrupted_(interrupted) {}

  /// False if interrupted.
  bool waitFor(std::int64_t time_ns) const {
    if (std::isinf(speed_)) return !isInterrupted();
    // A year is as good as for ever, and no duration overflows.
    constexpr double kYear_ns = 3.2e16;
    const double wait_ns = std::min(static_cast<double>(time_ns) / speed_, kYear_ns);
    const auto due = start_ + std::chrono::nanoseconds(static_cast<std::int64_t>(wait_ns));
    while (!isInterrupted()) {
      const auto now = Clock::now();
      if (now >= due) return true;
      std::this_thread::sleep_until(std::min(due, now + kLongestSleep));
    }
    return false;
  }
  double elapsed_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  bool isInterrupted() const { return interrupted_ && interrupted_(); }
  double speed_;
  const std::function<bool()>& interrupted_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace

Result<ReplaySummary> replaySession(const std::filesystem::path& folder,
                                    const ReplayOptions& options, RecordConsumer& consumer) {
  require(options.speed > 0.0, "a replay needs a speed above 0");
  auto reader = SessionReader::open(folder);
  if (!reader) return reader.error();
  if (auto done = consumer.begin((*reader)->header()); !done) return done.error();
  ReplaySummary summary;
  const Pace pace(options.speed, options.interrupted);
  while (true) {
    auto record = (*reader)->next();
    if (!record) return record.error();
    if (!record->has_value()) break;
    const std::int64_t time_ns = (*record)->time_ns;
    if (!pace.waitFor(time_ns)) {
      summary.interrupted = true;
      summary.wall_s = pace.elapsed_s();
      return summary;
    }
    if (auto done = consumer.consume(**record); !done) return done.error();
    ++summary.records;
    summary.recorded_ns = std::max(summary.recorded_ns, time_ns);
    if (options.progress) options.progress(time_ns);
  }
  summary.cut_bytes = (*reader)->tail().cut_bytes;
  summary.wall_s = pace.elapsed_s();
  if (auto done = consumer.end(); !done) return done.error();
  return summary;
}

std::string eventLine(const JournalRecord& record) {
  const std::string_view rest = withoutSequence(record.text);
  // Another program may have put its keys in another order.
  if (rest.size() == record.text.size()) return record.text;
  return "{" + std::string(rest);
}

Result<std::string> eventLine(std::int64_t time_ns, const RecordBody& body,
                              const SessionHeader& header) {
  auto encoded = encodeRecord(time_ns, body, header);
  if (!encoded) return encoded.error();
  return "{" + *std::move(encoded);
}

Result<void> EventLog::consume(const JournalRecord& record) {
  if (!isEvent(record.body)) return {};
  text_ += eventLine(record);
  text_ += '\n';
  ++lines_;
  return {};
}

}  // namespace tenter
