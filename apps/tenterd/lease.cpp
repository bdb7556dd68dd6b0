// SPDX-License-Identifier: GPL-3.0-or-later
#include "lease.h"

namespace tenter::daemon {

Lease::Taken Lease::acquire(std::uint64_t connection, const std::string& who, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  const bool in_force = connection_ != 0 && now_ns < until_ns_;
  if (in_force && connection_ != connection) return Taken::kRefused;
  const Taken taken = in_force ? Taken::kKept : Taken::kNew;
  connection_ = connection;
  who_ = who;
  until_ns_ = now_ns + kLength_ns;
  return taken;
}

bool Lease::heldByUser(const std::string& who, std::int64_t now_ns) const {
  const std::lock_guard lock(mutex_);
  return connection_ != 0 && who_ == who && now_ns < until_ns_;
}

bool Lease::renew(std::uint64_t connection, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  if (connection_ != connection || now_ns >= until_ns_) return false;
  until_ns_ = now_ns + kLength_ns;
  return true;
}

bool Lease::extend(std::uint64_t connection, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  if (connection_ != connection) return false;
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
