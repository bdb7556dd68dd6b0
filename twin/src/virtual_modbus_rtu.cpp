// SPDX-License-Identifier: GPL-3.0-or-later
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "virtual_modbus_server.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;

// Serial hardware hands bytes on when its queue is so full, or the line rests.
constexpr std::ptrdiff_t kQueue_bytes = 8;
// What is left of a request after so long a rest does not begin the next one.
constexpr std::int64_t kRest_ns = 20'000'000;

Error noTerminal(const fs::path& link, const std::string& what) {
  return {ErrorKind::kHardware, link.string(), "", what + ": " + std::strerror(errno), ""};
}

/// Points the link at the target; an existing link is replaced in one step.
bool pointLink(const fs::path& link, const fs::path& target) {
  const fs::path fresh = link.string() + ".new";
  std::error_code error;
  fs::remove(fresh, error);
  fs::create_symlink(target, fresh, error);
  if (!error) fs::rename(fresh, link, error);
  errno = error.value();
  return !error;
}

}  // namespace

Result<std::unique_ptr<VirtualModbus::Server>> VirtualModbus::RtuServer::make(
    VirtualUnits units, const VirtualRtuOptions& options) {
  std::error_code ignored;
  if (fs::exists(fs::symlink_status(options.link, ignored)) && !fs::is_symlink(options.link)) {
    return Error{ErrorKind::kBadInput, options.link.string(), "",
                 "is there already and is no symbolic link", "choose another place"};
  }
  if (options.baud < 1200) return badInput("", "baud", "must be at least 1200");
  std::unique_ptr<RtuServer> server(new RtuServer(std::move(units), options));
  if (const Result<void> opened = server->open(); !opened) return opened.error();
  server->startThread();
  return std::unique_ptr<Server>(std::move(server));
}

VirtualModbus::RtuServer::RtuServer(VirtualUnits units, const VirtualRtuOptions& options)
    : Server(std::move(units)), options_(options) {}

VirtualModbus::RtuServer::~RtuServer() {
  stopThread();
  close();
  std::error_code ignored;
  fs::remove(options_.link, ignored);
}

std::string VirtualModbus::RtuServer::address() const {
  return "rtu:" + options_.link.string() + ":" + std::to_string(options_.baud) + ":8N1";
}

Result<void> VirtualModbus::RtuServer::open() {
  std::array<char, 256> name{};
  termios raw{};
  cfmakeraw(&raw);
  cfsetspeed(&raw, B115200);
  raw.c_cflag |= CREAD | CLOCAL;
  if (openpty(&master_, &slave_, name.data(), &raw, nullptr) != 0) {
    return noTerminal(options_.link, "no pseudo-terminal could be opened");
  }
  if (!pointLink(options_.link, name.data())) {
    return noTerminal(options_.link, "the link could not be made");
  }
  return {};
}

void VirtualModbus::RtuServer::close() {
  if (slave_ >= 0) ::close(slave_);
  if (master_ >= 0) ::close(master_);
  master_ = slave_ = -1;
}

void VirtualModbus::RtuServer::addDescriptors(std::vector<pollfd>& entries) const {
  if (master_ >= 0) entries.push_back({master_, POLLIN, 0});
}

void VirtualModbus::RtuServer::handleInput(const pollfd& entry) {
  if (entry.fd != master_) return;
  std::array<std::uint8_t, 512> buffer;
  const ssize_t got = read(master_, buffer.data(), buffer.size());
  if (got <= 0) return hangUp(master_);
  const std::int64_t now_ns = serverTime_ns();
  if (now_ns - input_begin_ns_ > kRest_ns) input_.clear();
  if (input_.empty()) input_begin_ns_ = now_ns;
  input_.insert(input_.end(), buffer.begin(), buffer.begin() + got);
  while (const auto request = takeRtuRequest(input_)) answer(*request, input_begin_ns_);
}

void VirtualModbus::RtuServer::answer(const ModbusRequest& request, std::int64_t begin_ns) {
  const std::int64_t gap_ns =
      options_.paced ? std::max(std::int64_t{35} * character_ns() / 10, std::int64_t{1'750'000})
                     : 0;
  const std::int64_t wire_ns = options_.paced ? character_ns() : 0;
  VirtualCell* cell = findCell(request.unit);
  if (cell == nullptr) return;
  if (begin_ns < bus_free_ns_ + gap_ns && bus_free_ns_ > 0) {
    ++early_requests_;  // to the amplifiers one garbled frame with what went before
    return;
  }
  ++requests_;
  const ModbusReply reply = replyTo(request, *cell, false);
  if (reply.regular) ++answers_;
  std::int64_t time_ns = begin_ns + wire_ns * static_cast<std::int64_t>(request.frame.size()) +
                         gap_ns + std::chrono::nanoseconds(options_.turnaround).count() +
                         reply.delay.count();
  if (reply.hang_up) return hangUpAt(time_ns, master_);
  const bool dribbles = reply.per_byte.count() > 0;
  for (auto at = reply.bytes.begin(); at != reply.bytes.end();) {
    const std::ptrdiff_t rest = reply.bytes.end() - at;
    const std::ptrdiff_t size = dribbles ? 1 : std::min(kQueue_bytes, rest);
    time_ns += size * (wire_ns + reply.per_byte.count());
    sendAt(time_ns, master_, Bytes(at, at + size));
    at += size;
  }
  if (options_.paced && reply.delay.count() == 0) bus_free_ns_ = time_ns;
}

void VirtualModbus::RtuServer::output(int descriptor, const Bytes& bytes) {
  if (descriptor != master_) return;
  // A terminal whose reader is gone may be full; what does not fit is lost, as on a wire.
  pollfd entry{master_, POLLOUT, 0};
  if (poll(&entry, 1, 0) == 1 && (entry.revents & POLLOUT) != 0) {
    [[maybe_unused]] const ssize_t written = write(master_, bytes.data(), bytes.size());
  }
}

/// As an adapter that is pulled out and plugged in again.
void VirtualModbus::RtuServer::hangUp(int descriptor) {
  if (descriptor != master_) return;
  dropOutput(descriptor);
  close();
  input_.clear();
  bus_free_ns_ = 0;
  if (!open()) close();
}

}  // namespace tenter
