// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tenter/rig/rig_machine.h"

namespace tenter {

/// Puts all that the machine goes by into a session, so that its decisions can be made again: what
/// it remembers when the run begins, and then each tick (docs/formats/session.md).
class RigJournal {
 public:
  /// The record that stands before the first tick. `zero_ns` is the session's time 0 on the clock
  /// of the ticks.
  static RecordBody memoryRecord(const RigMemory& memory, std::int64_t zero_ns);
  /// The records of one tick; the sample is the last of them. What stays the same from tick to tick
  /// is said once.
  std::vector<RecordBody> tickRecords(const RigTick& tick);

 private:
  std::string last_;
};

/// Makes ticks of such records again. Times are the session's.
class RigJournalReader {
 public:
  /// `protocol`: what a command to run means.
  RigJournalReader(const RigConfig& config, std::shared_ptr<const CaptureProtocol> protocol)
      : config_(config), protocol_(std::move(protocol)) {}

  /// Takes the record of a tick's input; false if it is something else. Error: it is wrong.
  Result<bool> take(const JournalRecord& record);
  /// The tick that this sample completes. Precondition: its sizes are the configuration's.
  RigTick tickOf(const SampleRecord& sample, std::int64_t time_ns);
  /// What stood before the first tick, once it has been taken.
  const std::optional<RigMemory>& memory() const { return memory_; }

 private:
  Result<void> takeMemory(const JournalRecord& record, const std::string& data);
  Result<void> takeInput(const JournalRecord& record, const std::string& data);
  Result<void> takeHalt(const JournalRecord& record, const std::string& data);
  Result<void> takeCommand(const JournalRecord& record, const std::string& data);

  const RigConfig& config_;
  std::shared_ptr<const CaptureProtocol> protocol_;
  std::optional<RigMemory> memory_;
  RigTick tick_;
};

}  // namespace tenter
