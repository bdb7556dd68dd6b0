// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/types.h>

#include <atomic>
#include <filesystem>
#include <list>
#include <memory>
#include <string>
#include <thread>

#include "rpc.h"

namespace tenter::daemon {

/// A Unix socket of mode 0660 for the owner and the group; each client has a thread of its own, so
/// that no call of one keeps the stop of another waiting.
class SocketServer {
 public:
  /// `group`: name of the group that the socket is given to; empty: as the process has it. Error:
  /// the path is in use, too long, or cannot be made.
  static Result<std::unique_ptr<SocketServer>> listen(const std::filesystem::path& path,
                                                      const std::string& group, Rpc& rpc);
  ~SocketServer();
  SocketServer(const SocketServer&) = delete;
  SocketServer& operator=(const SocketServer&) = delete;

 private:
  struct Connection {
    int descriptor = -1;
    std::atomic<bool> done{false};
    std::thread thread;
  };

  SocketServer(std::filesystem::path path, int listener, gid_t group, Rpc& rpc);
  void acceptAll();
  void greet(int descriptor);
  void serve(Connection& connection, const Client& client);
  void converse(Connection& connection, const Client& client);
  void reap(bool all);

  std::filesystem::path path_;
  int listener_;
  gid_t group_;
  Rpc& rpc_;
  std::atomic<bool> quitting_{false};
  std::uint64_t last_connection_ = 0;
  std::list<Connection> connections_;  ///< Of the accepting thread.
  std::thread thread_;
};

}  // namespace tenter::daemon
