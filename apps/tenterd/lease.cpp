// SPDX-License-Identifier: GPL-3.0-or-later
#include "lease.h"

namespace tenter::daemon {

bool Lease::acquire(std::uint64_t connection, const std::string& who, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  if (connection_ != 0 && connection_ != connection && now_ns < until_ns_) return false;
  connection_ = connection;
  who_ = who;
  until_ns_ = now_ns + kLength_ns;
  return true;
}

bool Lease::renew(std::uint64_t connection, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  if (connection_ != connection || now_ns >= until_ns_) return false;
  until_ns_ = now_ns + kLength_ns;
  return true;
}

void Lease::release(std::uint64_t connection) {
  const std::lock_guard lock(mutex_);
  if (connection_ == connection) connection_ = 0;
}

bool Lease::heldBy(std::uint64_t connection, std::int64_t now_ns) const {
  const std::lock_guard lock(mutex_);
  return connection_ == connection && now_ns < until_ns_;
}

bool Lease::held(std::int64_t now_ns) const {
  const std::lock_guard lock(mutex_);
  return connection_ != 0 && now_ns < until_ns_;
}

std::string Lease::holder(std::int64_t now_ns) const {
  const std::lock_guard lock(mutex_);
  return connection_ != 0 && now_ns < until_ns_ ? who_ : "";
}

}  // namespace tenter::daemon
