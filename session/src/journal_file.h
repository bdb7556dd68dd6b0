// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>

#include "posix_file.h"
#include "tenter/core/result.h"

namespace tenter {

/// The journal opened for appending, by one writer at a time (flock). A line is handed to the
/// kernel by append; a thread syncs what has been there for `commit_interval`.
class JournalFile {
 public:
  /// Disk space kept behind the end where the file system can, so that a full disk still takes the
  /// events that tell of it.
  static constexpr std::int64_t kReserve_bytes = 256 << 10;

  /// `lock` is the descriptor from lockJournal; the file ends with its last whole line.
  static std::unique_ptr<JournalFile> open(std::filesystem::path file, Descriptor lock,
                                           std::int64_t size_bytes, std::uint64_t next_sequence,
                                           std::chrono::nanoseconds commit_interval);
  ~JournalFile();
  JournalFile(const JournalFile&) = delete;
  JournalFile& operator=(const JournalFile&) = delete;

  /// Adds a line for `encoded` (from encodeRecord). `may_use_reserve` for what must get through.
  /// On error the file is as it was.
  Result<std::uint64_t> append(std::string_view encoded, bool may_use_reserve);
  /// Returns once all that was appended before is on the disk.
  Result<void> sync();
  /// Syncs, gives the reserve back and unlocks. No append after it.
  Result<void> close();

  std::uint64_t records() const;
  std::uint64_t committed() const;

 private:
  JournalFile(std::filesystem::path file, Descriptor fd, std::int64_t size_bytes,
              std::uint64_t next_sequence, std::chrono::nanoseconds commit_interval);
  Result<void> makeRoom(std::int64_t bytes, bool may_use_reserve);
  Result<void> write(std::string_view line);
  void commitPeriodically(const std::stop_token& stop);

  const std::filesystem::path file_;
  const Descriptor fd_;
  const std::chrono::nanoseconds commit_interval_;

  mutable std::mutex mutex_;  ///< Guards what follows; never held during a sync.
  std::condition_variable_any appended_;
  std::string line_;           ///< Kept for its memory.
  std::int64_t size_bytes_;    ///< End of the last whole line.
  std::int64_t reserved_end_;  ///< The disk has room up to here.
  bool can_reserve_ = true;    ///< The file system knows how to.
  std::uint64_t next_sequence_;
  std::uint64_t committed_;
  std::optional<Error> broken_;  ///< After it nothing can be promised any more.
  bool closed_ = false;
  std::jthread committer_;  ///< Last, so that it ends first.
};

/// Opens a journal for appending and locks it. Error: it is locked already, or cannot be written.
Result<Descriptor> lockJournal(const std::filesystem::path& file);

}  // namespace tenter
