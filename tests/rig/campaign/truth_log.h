// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "tenter/twin/served_rig.h"

namespace tenter::campaign {

/// What a virtual rig truly did, looked at every millisecond by a thread of its own. Times are
/// CLOCK_MONOTONIC.
class TruthLog {
 public:
  explicit TruthLog(ServedRig& rig);
  ~TruthLog();
  TruthLog(const TruthLog&) = delete;
  TruthLog& operator=(const TruthLog&) = delete;

  void forget();
  /// Smallest and largest tension of a cord from one time to another; nothing where nobody looked
  /// for longer than 20 ms in between.
  std::optional<std::pair<double, double>> tensions_N(int cord, std::int64_t from_ns,
                                                      std::int64_t to_ns) const;
  /// When after `from_ns` any axis last drew its cord in, or moved at all; 0: never.
  std::int64_t lastLoading_ns(std::int64_t from_ns) const;
  std::int64_t lastMotion_ns(std::int64_t from_ns) const;
  /// Way that an axis drew in between two times, all upward steps together [m].
  double drawn_m(std::int64_t from_ns, std::int64_t to_ns) const;

 private:
  struct Look {
    /// The thread may be interrupted while it looks: what it saw was so some time in between.
    std::int64_t begin_ns = 0, time_ns = 0;
    std::array<double, ServedRig::kAxes> position_m{}, tension_N{};
  };
  void watch();
  Look look() const;

  ServedRig& rig_;
  mutable std::mutex mutex_;
  std::deque<Look> looks_;
  std::atomic<bool> quitting_{false};
  std::thread thread_;
};

}  // namespace tenter::campaign
