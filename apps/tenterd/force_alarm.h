// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>

#include "tenter/rig/load_cell.h"

namespace tenter::daemon {

/// Wakes the watch as soon as a cell is read beyond the absolute limit, from the thread that reads
/// it.
class ForceAlarm {
 public:
  explicit ForceAlarm(double absolute_N) : absolute_N_(absolute_N) {}

  bool beyond(const LoadCellReading& reading, std::int64_t now_ns) const {
    const auto gross_N = reading.gross_N(now_ns);
    return gross_N ? std::abs(*gross_N) > absolute_N_
                   : reading.faultAt(now_ns) == LoadCellFault::kOverRange;
  }

  void look(const LoadCellReading& reading) {
    if (!beyond(reading, reading.attempt_ns)) return;
    const std::lock_guard lock(mutex_);
    rung_ = true;
    changed_.notify_one();
  }

  /// Until look() sees a force beyond the limit, or the time is over.
  void wait(std::chrono::milliseconds limit) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, limit, [this] { return rung_; });
    rung_ = false;
  }

 private:
  double absolute_N_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool rung_ = false;
};

}  // namespace tenter::daemon
