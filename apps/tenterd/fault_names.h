// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "tenter/rig/load_cell_scanner.h"

namespace tenter::daemon {

/// Faults of cells between two ticks, from the threads that read them.
class CellEvents {
 public:
  void push(const LoadCellEvent& event);
  std::vector<LoadCellEvent> take();

 private:
  std::mutex mutex_;
  std::vector<LoadCellEvent> events_;
};

/// Which faults of devices are to be told: each when it comes, but one that comes and goes no more
/// than once a second.
class FaultNames {
 public:
  static constexpr std::int64_t kQuiet_ns = 1'000'000'000;
  bool isNews(const std::string& source, const std::string& fault, std::int64_t now_ns);
  /// As of a new session, which is to hold all that is wrong.
  void forget() { told_ns_.clear(); }

 private:
  std::map<std::pair<std::string, std::string>, std::int64_t> told_ns_;
};

}  // namespace tenter::daemon
