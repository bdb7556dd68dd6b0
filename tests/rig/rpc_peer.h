// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

namespace tenter::rig_system_test {

/// A client of the daemon's socket that knows nothing of `tenter rig`. Throws what goes wrong with
/// the connection.
class RpcPeer {
 public:
  explicit RpcPeer(const std::string& socket);
  ~RpcPeer();
  RpcPeer(const RpcPeer&) = delete;
  RpcPeer& operator=(const RpcPeer&) = delete;

  /// The whole answer: `result` or `error` is in it.
  nlohmann::json call(const std::string& method,
                      const nlohmann::json& params = nlohmann::json::object());
  /// True unless the daemon refused; lastError() then says why.
  bool order(const std::string& method, const nlohmann::json& params = nlohmann::json::object());
  const std::string& lastError() const { return error_; }
  nlohmann::json status() { return call("status").at("result"); }
  /// The longest that a call has taken since this was last asked [s]; but for `run`, which waits
  /// for the disk.
  double takeLongestCall_s() { return std::exchange(longest_s_, 0.0); }

 private:
  int descriptor_ = -1;
  std::int64_t id_ = 0;
  std::string pending_, error_;
  double longest_s_ = 0.0;
};

}  // namespace tenter::rig_system_test
