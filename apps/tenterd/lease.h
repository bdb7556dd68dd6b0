// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <mutex>
#include <string>

namespace tenter::daemon {

/// One operator at a time: whoever holds the lease, and renews it, may move the rig. Times are
/// CLOCK_MONOTONIC. From any thread.
class Lease {
 public:
  static constexpr std::int64_t kLength_ns = 2'000'000'000;

  enum class Taken { kRefused, kKept, kNew };

  /// For the client of that connection; refused while another one holds it. kNew: it did not hold
  /// it until now, so what moves was set going by somebody else.
  Taken acquire(std::uint64_t connection, const std::string& who, std::int64_t now_ns);
  /// False if that connection does not hold it (any more).
  bool renew(std::uint64_t connection, std::int64_t now_ns);
  /// After the daemon itself kept its holder from a heartbeat: also if it has run out meanwhile,
  /// but not if another one has it.
  bool extend(std::uint64_t connection, std::int64_t now_ns);
  void release(std::uint64_t connection);
  bool heldBy(std::uint64_t connection, std::int64_t now_ns) const;
  bool held(std::int64_t now_ns) const;
  /// Whether one of that user's programs holds it.
  bool heldByUser(const std::string& who, std::int64_t now_ns) const;
  std::string holder(std::int64_t now_ns) const;  ///< Empty if nobody.

 private:
  mutable std::mutex mutex_;
  std::uint64_t connection_ = 0;  ///< 0: nobody.
  std::string who_;
  std::int64_t until_ns_ = 0;
};

}  // namespace tenter::daemon
