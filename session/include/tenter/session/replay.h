// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <string>

#include "tenter/session/records.h"
#include "tenter/session/session_header.h"

namespace tenter {

/// Takes the records of a session in order. An error ends the replay and is its result.
class RecordConsumer {
 public:
  virtual ~RecordConsumer() = default;
  /// Once, before the first record.
  virtual Result<void> begin(const SessionHeader& /*header*/) { return {}; }
  virtual Result<void> consume(const JournalRecord& record) = 0;
  /// Once, after the last record; not after an error or an interrupt.
  virtual Result<void> end() { return {}; }
};

struct ReplayOptions {
  /// Recorded seconds per second of the clock, above 0; infinity: as fast as it goes.
  double speed = std::numeric_limits<double>::infinity();
  std::function<bool()> interrupted;  ///< Asked often; true ends the replay. May be empty.
  /// Told the time of each record [ns]. May be empty.
  std::function<void(std::int64_t)> progress;
};

struct ReplaySummary {
  std::uint64_t records = 0;
  std::uint64_t cut_bytes = 0;   ///< Torn tail that was left out.
  std::int64_t recorded_ns = 0;  ///< From the session's start to its last record.
  double wall_s = 0.0;
  bool interrupted = false;
};

/// Feeds a session to a consumer. Records whose time lies before one already fed follow at once.
Result<ReplaySummary> replaySession(const std::filesystem::path& folder,
                                    const ReplayOptions& options, RecordConsumer& consumer);

/// The record as one line of a log, without line end: its JSON without the sequence number, byte
/// for byte as recorded otherwise. Two runs that decide the same give the same lines, however many
/// samples lie between.
std::string eventLine(const JournalRecord& record);

/// The same of a record that is not in a journal: as the writer would have put it there. Error: a
/// value that the format has no place for.
Result<std::string> eventLine(std::int64_t time_ns, const RecordBody& body,
                              const SessionHeader& header);

/// Collects the eventLine of every record that isEvent(), each with a line end.
class EventLog : public RecordConsumer {
 public:
  Result<void> consume(const JournalRecord& record) override;
  const std::string& text() const { return text_; }
  std::uint64_t lines() const { return lines_; }

 private:
  std::string text_;
  std::uint64_t lines_ = 0;
};

}  // namespace tenter
