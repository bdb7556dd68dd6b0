// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/session/records.h"
#include "tenter/session/session_header.h"

namespace tenter {

/// When a record is safe from a power cut.
enum class Commit {
  kByKind,  ///< Samples with their group, everything else before append returns.
  kGroup,   ///< At most `commit_interval_ns` later; append does not wait for the disk.
  kNow,     ///< Before append returns.
};

/// One image to be stored, losslessly coded by the caller.
struct FrameImage {
  std::string camera;     ///< Letters, digits, '_', '-'; 1 to 64. Part of the file's name.
  std::string extension;  ///< "png"; lower-case letters and digits, 1 to 8.
  std::string_view bytes;
};

/// What opening a torn session did about it.
struct RepairReport {
  std::uint64_t cut_bytes = 0;           ///< Torn tail of the journal, moved into `report`.
  std::uint64_t cut_records = 0;         ///< Lines begun in it; none of them was committed.
  std::uint64_t offset_bytes = 0;        ///< Where it was cut.
  bool newline_added = false;            ///< The last record was whole but for its line's end.
  std::vector<std::string> stray_files;  ///< Images without a record, moved into `report`.
  std::string report;  ///< "repairs/000000012345-1a2b3c4d", relative to the session; or empty.
  std::uint64_t damaged_lines = 0;  ///< Before the tail; left where they are for `verifySession`.
};

struct ResumedSession;

/// The one writer of a session (docs/formats/session.md). Every append reaches the kernel before it
/// returns, so that killing the process loses nothing; what a power cut may take is said by Commit.
/// Errors of the disk are returned, and the journal then ends with its last whole record: after
/// "no space" the append may be tried again, after a failed sync every append fails. When the disk
/// is nearly full, samples and frames are refused while a reserve still takes events.
/// All members may be called from several threads.
class SessionWriter {
 public:
  /// Makes the folder, complete or absent, with its "begin" record. Error: the header is invalid,
  /// or the folder exists and is not empty.
  static Result<std::unique_ptr<SessionWriter>> create(const std::filesystem::path& folder,
                                                       const SessionHeader& header);
  /// Opens a session again, repairs a torn tail, adds a "resumed" record. Error: not a session,
  /// another writer has it open, the journal of another session, nothing can be written.
  static Result<ResumedSession> resume(
      const std::filesystem::path& folder,
      std::chrono::system_clock::time_point now = std::chrono::system_clock::now());
  /// Opens a whole session to add what became known only afterwards; unlike resume it records
  /// nothing of its own, and the session's time stands still. Error as there, or the session is
  /// torn.
  static Result<std::unique_ptr<SessionWriter>> amend(const std::filesystem::path& folder);
  /// Repairs a session and closes it again; one that is whole is left as it is.
  static Result<RepairReport> repair(
      const std::filesystem::path& folder,
      std::chrono::system_clock::time_point now = std::chrono::system_clock::now());
  /// Syncs what is left; failures go unseen, so call close().
  ~SessionWriter();
  SessionWriter(const SessionWriter&) = delete;
  SessionWriter& operator=(const SessionWriter&) = delete;

  /// Adds a record and returns its sequence number. `time_ns` since the session's start, not
  /// negative. Error: sizes or values that the format has no place for, or the disk's.
  Result<std::uint64_t> append(std::int64_t time_ns, const RecordBody& body,
                               Commit commit = Commit::kByKind);

  /// Stores the images of one moment, then their record, all on disk before it returns. On error
  /// neither is there.
  Result<FrameRecord> addFrame(std::int64_t time_ns, std::span<const FrameImage> images);

  /// Puts everything so far on the disk.
  Result<void> sync();
  /// Adds the "closed" record and ends; another writer may then open the session. No append after
  /// it.
  Result<void> close(std::int64_t time_ns);

  /// Records that are on the disk for certain: those with smaller sequence numbers.
  std::uint64_t committedRecords() const;
  std::uint64_t records() const;
  /// Largest time so far [ns]; whoever resumes goes on from here.
  std::int64_t lastTime_ns() const;
  const SessionHeader& header() const;
  const std::filesystem::path& folder() const;

 private:
  struct State;
  explicit SessionWriter(std::unique_ptr<State> state);
  static Result<ResumedSession> open(const std::filesystem::path& folder,
                                     std::chrono::system_clock::time_point now,
                                     bool leave_if_whole);
  std::unique_ptr<State> state_;
};

struct ResumedSession {
  std::unique_ptr<SessionWriter> writer;
  RepairReport repair;
};

}  // namespace tenter
