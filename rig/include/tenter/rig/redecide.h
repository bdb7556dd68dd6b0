// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "tenter/rig/rig_journal.h"
#include "tenter/session/replay.h"

namespace tenter {

/// Feeds the inputs of a recorded session to a new RigMachine, which decides again, and compares
/// what it says with what was recorded. Events that the machine did not make (of the store, of
/// devices) are copied. Of a session that broke off, events may be missing after its last tick.
class Redecider : public RecordConsumer {
 public:
  Result<void> begin(const SessionHeader& header) override;
  Result<void> consume(const JournalRecord& record) override;
  Result<void> end() override;

  /// Whether the session holds the inputs; without, the log is the recorded one.
  bool decided() const { return machine_ != nullptr; }
  std::uint64_t ticks() const { return ticks_; }
  /// Events as decided now, one a line.
  const std::string& text() const { return decided_; }
  std::uint64_t lines() const;
  bool identical() const { return decided_ == recorded_; }
  /// Number, from 1, of the first line that differs. Precondition: !identical().
  std::uint64_t firstDifference() const;

 private:
  Result<void> tick(const SampleRecord& sample, std::int64_t time_ns);
  void compare(const JournalRecord& record);
  void flush();

  SessionHeader header_;
  RigConfig config_;
  std::unique_ptr<RigJournalReader> reader_;
  std::unique_ptr<RigMachine> machine_;
  std::deque<std::string> expected_;  ///< Lines of the last tick that were not yet met.
  std::string decided_, recorded_;
  std::uint64_t ticks_ = 0;
  bool closed_ = false;
};

}  // namespace tenter
