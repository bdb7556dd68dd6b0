// SPDX-License-Identifier: GPL-3.0-or-later
#include "rpc_peer.h"

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <stdexcept>

namespace tenter::rig_system_test {

RpcPeer::RpcPeer(const std::string& socket_path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(socket_path.begin(), socket_path.end(), address.sun_path);
  descriptor_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const timeval patience{10, 0};
  setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  if (connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    close(descriptor_);
    throw std::runtime_error("nobody listens on " + socket_path);
  }
}

RpcPeer::~RpcPeer() { close(descriptor_); }

nlohmann::json RpcPeer::call(const std::string& method, const nlohmann::json& params) {
  const auto start = std::chrono::steady_clock::now();
  const std::string line =
      nlohmann::json{{"jsonrpc", "2.0"}, {"id", ++id_}, {"method", method}, {"params", params}}
          .dump() +
      "\n";
  if (send(descriptor_, line.data(), line.size(), MSG_NOSIGNAL) !=
      static_cast<ssize_t>(line.size())) {
    throw std::runtime_error("the daemon hung up");
  }
  std::array<char, 4096> chunk{};
  std::size_t end = 0;
  while ((end = pending_.find('\n')) == std::string::npos) {
    const ssize_t n = recv(descriptor_, chunk.data(), chunk.size(), 0);
    if (n <= 0) throw std::runtime_error("no answer to " + method);
    pending_.append(chunk.data(), static_cast<std::size_t>(n));
  }
  nlohmann::json answer = nlohmann::json::parse(pending_.substr(0, end));
  pending_.erase(0, end + 1);
  const double taken_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (method != "run") longest_s_ = std::max(longest_s_, taken_s);
  return answer;
}

bool RpcPeer::order(const std::string& method, const nlohmann::json& params) {
  const nlohmann::json answer = call(method, params);
  if (answer.contains("result")) return true;
  error_ = answer.at("error").at("message").get<std::string>();
  return false;
}

}  // namespace tenter::rig_system_test
