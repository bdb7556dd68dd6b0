// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "tenter/session/session_writer.h"

namespace tenter::daemon {

/// Writes one session from a thread of its own, so that the loop never waits for the disk.
class Recorder {
 public:
  /// Times are CLOCK_MONOTONIC; `start_ns` is the session's time 0.
  Recorder(std::unique_ptr<SessionWriter> writer, std::int64_t start_ns);
  /// Writes what is left and closes the session, if it is not.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void append(std::int64_t time_ns, RecordBody body);
  /// While what it returns lives, the session stays open, close() or not: of whoever is to add a
  /// frame.
  std::shared_ptr<void> expectFrames();
  /// Images of one moment, on the disk before it returns; from another thread than append().
  Result<FrameRecord> addFrame(std::int64_t time_ns, std::span<const FrameImage> images);
  /// Closes the session once all before it is written; does not wait.
  void close(std::int64_t time_ns);

  bool closed() const;
  std::string fault() const;  ///< Why nothing more can be written; empty if all is well.
  std::string folder() const;
  std::int64_t start_ns() const;

 private:
  struct Item {
    std::int64_t time_ns;
    RecordBody body;
  };
  void write();
  void take(std::deque<Item> items);

  std::unique_ptr<SessionWriter> writer_;
  std::int64_t start_ns_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Item> queue_;
  std::int64_t close_ns_ = -1;
  int expected_ = 0;  ///< Frames that are to come.
  bool closed_ = false;
  std::string fault_;
  std::optional<std::int64_t> writing_since_ns_;  ///< What is being written now.
  std::thread thread_;
};

}  // namespace tenter::daemon
