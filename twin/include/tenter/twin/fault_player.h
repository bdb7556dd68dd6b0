// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <thread>

#include "tenter/twin/fault_schedule.h"
#include "tenter/twin/served_rig.h"

namespace tenter {

/// Plays a script on a served rig from a thread of its own, every 2 ms, and writes what began and
/// ended, with the truth of that moment, as JSON lines.
class FaultPlayer {
 public:
  /// The rig must outlive it. Error: the log cannot be written.
  static Result<std::unique_ptr<FaultPlayer>> start(ServedRig& rig, FaultScript script,
                                                    const std::filesystem::path& log);
  ~FaultPlayer();
  FaultPlayer(const FaultPlayer&) = delete;
  FaultPlayer& operator=(const FaultPlayer&) = delete;

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  FaultPlayer(ServedRig& rig, FaultScript script, std::FILE* log);
  void play();
  RigSnapshot look() const;
  void write(const ScriptedFault& fault, bool begins, double time_s, const RigSnapshot& now);

  ServedRig& rig_;
  FaultSchedule schedule_;
  std::unique_ptr<std::FILE, Close> log_;
  std::atomic<bool> quitting_{false};
  std::thread thread_;
};

/// Begins or ends a fault on a rig. A plug that does not go back in stays out.
void applyFault(ServedRig& rig, const ScriptedFault& fault, bool begins);

}  // namespace tenter
