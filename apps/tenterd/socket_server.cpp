// SPDX-License-Identifier: GPL-3.0-or-later
#include "socket_server.h"

#include <grp.h>
#include <poll.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <thread>
#include <vector>

#include "daemon_log.h"

namespace tenter::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestLine_bytes = std::size_t{1} << 20;
/// Beyond so many clients those that come may only stop the rig, and beyond twice as many nothing.
constexpr std::size_t kMaxConnections = 32;
constexpr int kPoll_ms = 100;
/// Processor time that one client's requests may take: a fiftieth of the time, and so much at once.
/// Then it is not heard until it has that again, so that however many and however long requests
/// are, the watch gets its turn.
constexpr int kTimePerWork = 50;
constexpr std::chrono::nanoseconds kWorkAtOnce = std::chrono::milliseconds(50),
                                   kLongestPause = std::chrono::seconds(1);

std::chrono::nanoseconds threadTime() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

/// Of the thread that it is used in.
class WorkBudget {
 public:
  void pauseIfSpent() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::nanoseconds work = threadTime();
    left_ = std::min(left_ + (now - last_) / kTimePerWork - (work - last_work_), kWorkAtOnce);
    last_ = now;
    last_work_ = work;
    if (left_ < left_.zero())
      std::this_thread::sleep_for(std::min(-kTimePerWork * left_, kLongestPause));
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::chrono::nanoseconds last_work_ = threadTime(), left_ = kWorkAtOnce;
};

Error socketError(const fs::path& path, const std::string& what) {
  return Error{ErrorKind::kBadInput, path.string(), "", what + ": " + std::strerror(errno), ""};
}

std::string userName(uid_t user) {
  passwd entry{};
  passwd* found = nullptr;
  std::array<char, 4096> buffer{};
  getpwuid_r(user, &entry, buffer.data(), buffer.size(), &found);
  return found != nullptr ? entry.pw_name : "user " + std::to_string(user);
}

/// Root, the daemon's own user, and members of the socket's group.
bool mayEnter(const ucred& peer, gid_t group) {
  if (peer.uid == 0 || peer.uid == geteuid() || peer.gid == group) return true;
  std::array<gid_t, 256> groups{};
  int count = static_cast<int>(groups.size());
  const std::string name = userName(peer.uid);
  if (getgrouplist(name.c_str(), peer.gid, groups.data(), &count) < 0) return false;
  return std::find(groups.begin(), groups.begin() + count, group) != groups.begin() + count;
}

/// Descriptors go with the first byte of the text.
bool sendAll(int descriptor, std::string& text, const std::vector<Descriptor>& attached) {
  std::size_t sent = 0;
  if (!attached.empty()) {
    std::vector<int> numbers;
    for (const Descriptor& one : attached) numbers.push_back(one.number());
    const std::size_t size_bytes = numbers.size() * sizeof(int);
    std::vector<char> control(CMSG_SPACE(size_bytes));
    iovec first{text.data(), 1};
    msghdr message{};
    message.msg_iov = &first;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(size_bytes);
    std::memcpy(CMSG_DATA(header), numbers.data(), size_bytes);
    if (sendmsg(descriptor, &message, MSG_NOSIGNAL) != 1) return false;
    sent = 1;
  }
  while (sent < text.size()) {
    const ssize_t n = send(descriptor, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) return false;
    sent += static_cast<std::size_t>(n);
  }
  return true;
}

bool somebodyListens(const sockaddr_un& address) {
  const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool answered = probe >= 0 && connect(probe, reinterpret_cast<const sockaddr*>(&address),
                                              sizeof address) == 0;
  if (probe >= 0) close(probe);
  return answered;
}

}  // namespace

Result<std::unique_ptr<SocketServer>> SocketServer::listen(const fs::path& path,
                                                           const std::string& group, Rpc& rpc) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string text = path.string();
  if (text.empty() || text.size() >= sizeof address.sun_path) {
    return badInput(text, "", "is too long for a socket",
                    "at most " + std::to_string(sizeof address.sun_path - 1) + " bytes");
  }
  std::copy(text.begin(), text.end(), address.sun_path);
  gid_t group_id = getegid();
  if (!group.empty()) {
    const struct group* entry = getgrnam(group.c_str());
    if (entry == nullptr) return badInput(text, "group", "there is no group " + group);
    group_id = entry->gr_gid;
  }
  if (fs::is_socket(path)) {
    if (somebodyListens(address)) return badInput(text, "", "another daemon listens there");
    fs::remove(path);
  }
  const int listener = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (listener < 0) return socketError(path, "no socket");
  const mode_t before = umask(0117);  // nobody gets in before listen(), and then the group is right
  const bool bound =
      bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  umask(before);
  if (!bound || chown(text.c_str(), static_cast<uid_t>(-1), group_id) != 0 ||
      chmod(text.c_str(), 0660) != 0 || ::listen(listener, 16) != 0) {
    const Error error = socketError(path, "cannot listen");
    close(listener);
    return error;
  }
  return std::unique_ptr<SocketServer>(new SocketServer(path, listener, group_id, rpc));
}

SocketServer::SocketServer(fs::path path, int listener, gid_t group, Rpc& rpc)
    : path_(std::move(path)), listener_(listener), group_(group), rpc_(rpc), thread_([this] {
        acceptAll();
      }) {}

SocketServer::~SocketServer() {
  quitting_ = true;
  thread_.join();
  close(listener_);
  std::error_code ignored;
  fs::remove(path_, ignored);
}

void SocketServer::acceptAll() {
  while (!quitting_) {
    pollfd waiting{listener_, POLLIN, 0};
    if (poll(&waiting, 1, kPoll_ms) <= 0) continue;
    const int descriptor = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    reap(false);
    if (descriptor >= 0) greet(descriptor);
  }
  reap(true);
}

void SocketServer::greet(int descriptor) {
  ucred peer{};
  socklen_t size = sizeof peer;
  const bool known = getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0;
  if (!known || !mayEnter(peer, group_) || connections_.size() >= 2 * kMaxConnections) {
    logEvent(LogLevel::kWarning, "refused-client", {{"user", userName(peer.uid)}});
    close(descriptor);
    return;
  }
  const bool crowded = connections_.size() >= kMaxConnections;
  Connection& connection = connections_.emplace_back();
  connection.descriptor = descriptor;
  const Client client{++last_connection_, userName(peer.uid), crowded};
  connection.thread = std::thread([this, &connection, client] { serve(connection, client); });
}

void SocketServer::serve(Connection& connection, const Client& client) {
  try {
    converse(connection, client);
  } catch (const std::exception& error) {
    logEvent(LogLevel::kError, "client-failed", {{"user", client.user}, {"text", error.what()}});
  }
  rpc_.clientGone(client);
  shutdown(connection.descriptor, SHUT_RDWR);
  connection.done = true;
}

void SocketServer::converse(Connection& connection, const Client& client) {
  std::string pending;
  std::array<char, 4096> chunk{};
  WorkBudget budget;
  bool open = true;
  while (open) {
    const ssize_t n = recv(connection.descriptor, chunk.data(), chunk.size(), 0);
    if (n <= 0) break;
    pending.append(chunk.data(), static_cast<std::size_t>(n));
    for (auto end = pending.find('\n'); open && end != std::string::npos;
         end = pending.find('\n')) {
      std::vector<Descriptor> attached;
      std::string answer = rpc_.answer(std::string_view(pending).substr(0, end), client, attached);
      pending.erase(0, end + 1);
      if (!answer.empty()) {
        answer += '\n';
        open = sendAll(connection.descriptor, answer, attached);
      }
      budget.pauseIfSpent();
    }
    if (pending.size() > kLongestLine_bytes) break;
  }
}

void SocketServer::reap(bool all) {
  for (auto it = connections_.begin(); it != connections_.end();) {
    if (!all && !it->done) {
      ++it;
      continue;
    }
    shutdown(it->descriptor, SHUT_RDWR);
    it->thread.join();
    close(it->descriptor);
    it = connections_.erase(it);
  }
}

}  // namespace tenter::daemon
