// SPDX-License-Identifier: GPL-3.0-or-later
#include "rig_client.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "tenter/core/json_reader.h"

namespace tenter::app {

namespace {

/// A set of images may be taken several times, and the daemon may wait for its cameras.
constexpr timeval kLongestWait{30, 0};
constexpr std::size_t kMostFiles = 16;  // a rig has no more cameras
constexpr std::size_t kLongestAnswer_bytes = std::size_t{4} << 20;

Error lost(const std::string& what) { return Error{ErrorKind::kHardware, "", "tenterd", what, ""}; }

Result<nlohmann::json> contentOf(const nlohmann::json& answer) {
  if (answer.is_object() && answer.contains("result")) return answer["result"];
  if (!answer.is_object() || !answer.contains("error") || !answer["error"].is_object()) {
    return lost("the answer is not JSON-RPC");
  }
  const nlohmann::json& error = answer["error"];
  auto kind = ErrorKind::kHardware;
  const auto number = error.value("data", nlohmann::json::object()).value("kind", nlohmann::json());
  if (number == static_cast<int>(ErrorKind::kInterlock)) kind = ErrorKind::kInterlock;
  if (number == static_cast<int>(ErrorKind::kBadInput)) kind = ErrorKind::kBadInput;
  const nlohmann::json message = error.value("message", nlohmann::json());
  return Error{kind, "", "", message.is_string() ? message.get<std::string>() : "unknown error",
               ""};
}

}  // namespace

Result<std::unique_ptr<RigClient>> RigClient::connect(const std::string& socket) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket.size() >= sizeof address.sun_path) {
    return usageError("--socket " + socket + ": is too long for a socket");
  }
  std::copy(socket.begin(), socket.end(), address.sun_path);
  const int descriptor = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::unique_ptr<RigClient> client(new RigClient(descriptor));
  setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &kLongestWait, sizeof kLongestWait);
  if (::connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return Error{ErrorKind::kHardware, socket, "", std::strerror(errno),
                 "is tenterd running, and are you in the socket's group?"};
  }
  return client;
}

RigClient::~RigClient() {
  if (descriptor_ >= 0) close(descriptor_);
}

FileDescriptor::~FileDescriptor() {
  if (number_ >= 0) close(number_);
}

std::size_t FileDescriptor::size_bytes() const {
  struct stat status {};
  return fstat(number_, &status) == 0 ? static_cast<std::size_t>(status.st_size) : 0;
}

/// The next piece of an answer, and the files that came with it.
bool RigClient::receive() {
  std::array<char, 4096> chunk{};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kMostFiles * sizeof(int))> control{};
  iovec piece{chunk.data(), chunk.size()};
  msghdr message{};
  message.msg_iov = &piece;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t n = recvmsg(descriptor_, &message, MSG_CMSG_CLOEXEC);
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr && n > 0;
       header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t count = (header->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t i = 0; i < count; ++i) {
      int number = -1;
      std::memcpy(&number, CMSG_DATA(header) + i * sizeof(int), sizeof number);
      files_.emplace_back(number);
    }
  }
  if (n > 0) pending_.append(chunk.data(), static_cast<std::size_t>(n));
  return n > 0;
}

Result<nlohmann::json> RigClient::call(const std::string& method, const nlohmann::json& params) {
  const nlohmann::json request{
      {"jsonrpc", "2.0"}, {"id", ++last_id_}, {"method", method}, {"params", params}};
  const std::string line =
      request.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  for (std::size_t sent = 0; sent < line.size();) {
    const ssize_t n = send(descriptor_, line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) return lost("the connection is closed");
    sent += static_cast<std::size_t>(n);
  }
  files_.clear();
  for (auto end = pending_.find('\n'); end == std::string::npos; end = pending_.find('\n')) {
    if (!receive() || pending_.size() > kLongestAnswer_bytes) return lost("no answer");
  }
  const auto end = pending_.find('\n');
  const auto answer = parseJson(std::string_view(pending_).substr(0, end), "answer");
  pending_.erase(0, end + 1);
  if (!answer) return answer.error();
  return contentOf(*answer);
}

}  // namespace tenter::app
