// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace tenter {

/// While it lasts, this thread's only network interface is an address of the loopback. All of
/// 127.0.0.0/8 may be bound to, but only addresses that are assigned are listed, and a simulated
/// camera takes none but listed ones.
class LoopbackScope {
 public:
  explicit LoopbackScope(const std::string& address);
  ~LoopbackScope();
  LoopbackScope(const LoopbackScope&) = delete;
  LoopbackScope& operator=(const LoopbackScope&) = delete;
};

}  // namespace tenter
