// SPDX-License-Identifier: GPL-3.0-or-later
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>

#include "virtual_modbus_server.h"

namespace tenter {
namespace {

constexpr int kBacklog = 8;
constexpr std::size_t kMostConnections = 32;

Error noServer(int port) {
  return {ErrorKind::kHardware, "", "port " + std::to_string(port),
          "cannot be served: " + std::string(std::strerror(errno)), "choose another port"};
}

/// Listening socket on 127.0.0.1, -1 with errno set.
int listenOn(int& port) {
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener < 0) return -1;
  const int on = 1;
  setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  const bool good = bind(listener, generic, length) == 0 && listen(listener, kBacklog) == 0 &&
                    getsockname(listener, generic, &length) == 0;
  if (!good) {
    const int error = errno;
    close(listener);
    errno = error;
    return -1;
  }
  port = ntohs(address.sin_port);
  return listener;
}

}  // namespace

Result<std::unique_ptr<VirtualModbus::Server>> VirtualModbus::TcpServer::make(
    VirtualUnits units, const VirtualTcpOptions& options) {
  int port = options.port;
  const int listener = listenOn(port);
  if (listener < 0) return noServer(options.port);
  std::unique_ptr<TcpServer> server(new TcpServer(std::move(units), options, listener, port));
  server->startThread();
  return std::unique_ptr<Server>(std::move(server));
}

VirtualModbus::TcpServer::TcpServer(VirtualUnits units, const VirtualTcpOptions& options,
                                    int listener, int port)
    : Server(std::move(units)), turnaround_(options.turnaround), listener_(listener), port_(port) {}

VirtualModbus::TcpServer::~TcpServer() {
  stopThread();
  close(listener_);
  for (const auto& [descriptor, input] : inputs_) close(descriptor);
}

std::string VirtualModbus::TcpServer::address() const {
  return "tcp:127.0.0.1:" + std::to_string(port_);
}

void VirtualModbus::TcpServer::addDescriptors(std::vector<pollfd>& entries) const {
  entries.push_back({listener_, POLLIN, 0});
  for (const auto& [descriptor, input] : inputs_) entries.push_back({descriptor, POLLIN, 0});
}

void VirtualModbus::TcpServer::accept() {
  const int descriptor = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (descriptor < 0) return;
  if (inputs_.size() >= kMostConnections) {
    close(descriptor);
    return;
  }
  const int on = 1;
  setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  inputs_[descriptor];
}

void VirtualModbus::TcpServer::drop(int descriptor) {
  dropOutput(descriptor);
  inputs_.erase(descriptor);
  close(descriptor);
}

void VirtualModbus::TcpServer::handleInput(const pollfd& entry) {
  if (entry.fd == listener_) return accept();
  if (!inputs_.contains(entry.fd)) return;  // dropped in this round
  std::array<std::uint8_t, 4096> buffer;
  const ssize_t got = recv(entry.fd, buffer.data(), buffer.size(), 0);
  if (got <= 0) return drop(entry.fd);
  Bytes& input = inputs_[entry.fd];
  input.insert(input.end(), buffer.begin(), buffer.begin() + got);
  bool broken = false;
  while (const auto request = takeTcpRequest(input, broken)) answer(entry.fd, *request);
  if (broken) drop(entry.fd);
}

void VirtualModbus::TcpServer::answer(int descriptor, const ModbusRequest& request) {
  std::int64_t time_ns = serverTime_ns() + turnaround_.count();
  VirtualCell* cell = findCell(request.unit);
  if (cell == nullptr) return sendAt(time_ns, descriptor, gatewayReply(request));
  ++requests_;
  ModbusReply reply = replyTo(request, *cell, true);
  if (reply.regular) ++answers_;
  if (reply.hang_up) return hangUpAt(time_ns, descriptor);
  time_ns += reply.delay.count();
  if (reply.per_byte.count() == 0) {
    if (!reply.bytes.empty()) sendAt(time_ns, descriptor, std::move(reply.bytes));
    return;
  }
  for (const std::uint8_t byte : reply.bytes) {
    sendAt(time_ns, descriptor, {byte});
    time_ns += reply.per_byte.count();
  }
}

void VirtualModbus::TcpServer::output(int descriptor, const Bytes& bytes) {
  if (inputs_.contains(descriptor)) {
    send(descriptor, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
}

/// With a reset, as an amplifier that loses its power and comes back.
void VirtualModbus::TcpServer::hangUp(int descriptor) {
  if (!inputs_.contains(descriptor)) return;
  const linger at_once{1, 0};
  setsockopt(descriptor, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  drop(descriptor);
}

}  // namespace tenter
