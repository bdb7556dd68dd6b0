// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tenter/session/records.h"
#include "tenter/session/session_header.h"

namespace tenter {

/// What stands behind the last whole record of a journal.
struct TornTail {
  std::uint64_t offset_bytes = 0;  ///< End of the last whole record.
  std::uint64_t cut_bytes = 0;     ///< What opening for writing will cut.
  std::uint64_t cut_records = 0;   ///< Lines begun in it.
};

/// Reads a session's records in order, in constant memory. Changes nothing on disk.
class SessionReader {
 public:
  /// Error: no session there, or an invalid header.
  static Result<std::unique_ptr<SessionReader>> open(const std::filesystem::path& folder);
  ~SessionReader();
  SessionReader(const SessionReader&) = delete;
  SessionReader& operator=(const SessionReader&) = delete;

  const SessionHeader& header() const;
  /// The next record, or nothing at the end. Error, naming the line: damage before the last whole
  /// record, a sequence number out of order, a value that cannot be. A torn tail is the end.
  Result<std::optional<JournalRecord>> next();
  /// Valid once next() has returned nothing.
  const TornTail& tail() const;

 private:
  struct State;
  explicit SessionReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// What a session holds and what is wrong with it.
struct SessionReport {
  std::uint64_t records = 0;      ///< Whole lines.
  std::uint64_t frames = 0;       ///< Records of frames.
  std::uint64_t samples = 0;      ///< Records of samples.
  std::uint64_t events = 0;       ///< Records that isEvent().
  std::uint64_t cut_bytes = 0;    ///< Torn tail now, and those that earlier repairs took away.
  std::uint64_t cut_records = 0;  ///< The same in lines.
  std::uint64_t repairs = 0;      ///< Repair reports in the session.
  std::uint64_t stray_files = 0;  ///< In frames/ without a record; a kill while writing leaves one.
  std::int64_t duration_ns = 0;   ///< Largest time of a record.
  bool closed = false;            ///< The last record says that the session ended as it should.
  std::uint64_t rest_pictures = 0;    ///< Of the sample at rest, on record.
  std::vector<std::string> notes;     ///< What is worth knowing and no problem: "place: what".
  std::vector<std::string> problems;  ///< "place: what", at most 1000 and then how many more.
  bool ok() const { return problems.empty(); }
};

/// Counts records without looking at images. Error: no session there, or an invalid header.
Result<SessionReport> inspectSession(const std::filesystem::path& folder);

/// Checks everything: the header's hash, every line's CRC, sequence numbers and values, every
/// image's presence, size and SHA-256, those at rest included, the repair reports. A tail torn by a
/// crash is no problem, it is counted; whole lines that are wrong are. Error: no session there, or
/// an invalid header.
Result<SessionReport> verifySession(const std::filesystem::path& folder);

}  // namespace tenter
