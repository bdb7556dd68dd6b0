// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/virtual_modbus.h"

#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <chrono>

#include "virtual_modbus_server.h"

namespace tenter {

std::int64_t serverTime_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

VirtualModbus::Server::Server(VirtualUnits units)
    : units_(std::move(units)), wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

VirtualModbus::Server::~Server() { ::close(wake_); }

VirtualModbusCounts VirtualModbus::Server::counts() const {
  return {requests_, answers_, early_requests_};
}

void VirtualModbus::Server::startThread() {
  thread_ = std::thread([this] { loop(); });
}

void VirtualModbus::Server::stopThread() {
  stop_ = true;
  eventfd_write(wake_, 1);
  if (thread_.joinable()) thread_.join();
}

VirtualCell* VirtualModbus::Server::findCell(int unit) const {
  const auto found = units_.find(unit);
  return found == units_.end() ? nullptr : found->second.get();
}

void VirtualModbus::Server::sendAt(std::int64_t time_ns, int descriptor, Bytes bytes) {
  pending_.emplace(time_ns, Pending{descriptor, std::move(bytes), false});
}

void VirtualModbus::Server::hangUpAt(std::int64_t time_ns, int descriptor) {
  pending_.emplace(time_ns, Pending{descriptor, {}, true});
}

void VirtualModbus::Server::dropOutput(int descriptor) {
  std::erase_if(pending_, [&](const auto& entry) { return entry.second.descriptor == descriptor; });
}

void VirtualModbus::Server::sendDue() {
  while (!pending_.empty() && pending_.begin()->first <= serverTime_ns()) {
    const Pending due = std::move(pending_.begin()->second);
    pending_.erase(pending_.begin());
    if (due.hang_up) {
      hangUp(due.descriptor);
    } else {
      output(due.descriptor, due.bytes);
    }
  }
}

void VirtualModbus::Server::loop() {
  prctl(PR_SET_TIMERSLACK, 1000UL, 0UL, 0UL, 0UL);  // the wire's characters are shorter than 50 us
  std::vector<pollfd> entries;
  while (!stop_) {
    sendDue();
    entries.assign(1, {wake_, POLLIN, 0});
    addDescriptors(entries);
    timespec timeout{};
    if (!pending_.empty()) {
      const std::int64_t wait_ns =
          std::max<std::int64_t>(pending_.begin()->first - serverTime_ns(), 0);
      timeout = {wait_ns / 1'000'000'000, wait_ns % 1'000'000'000};
    }
    const timespec* until = pending_.empty() ? nullptr : &timeout;
    if (ppoll(entries.data(), entries.size(), until, nullptr) <= 0) continue;
    for (std::size_t i = 1; i < entries.size(); ++i) {
      if (entries[i].revents != 0) handleInput(entries[i]);
    }
  }
}

VirtualModbus::VirtualModbus(std::unique_ptr<Server> server) : server_(std::move(server)) {}

VirtualModbus::~VirtualModbus() = default;

Result<std::unique_ptr<VirtualModbus>> VirtualModbus::serveTcp(VirtualUnits units,
                                                               const VirtualTcpOptions& options) {
  auto server = TcpServer::make(std::move(units), options);
  if (!server) return server.error();
  return std::unique_ptr<VirtualModbus>(new VirtualModbus(std::move(*server)));
}

Result<std::unique_ptr<VirtualModbus>> VirtualModbus::serveRtu(VirtualUnits units,
                                                               const VirtualRtuOptions& options) {
  auto server = RtuServer::make(std::move(units), options);
  if (!server) return server.error();
  return std::unique_ptr<VirtualModbus>(new VirtualModbus(std::move(*server)));
}

std::string VirtualModbus::address() const { return server_->address(); }

int VirtualModbus::port() const { return server_->port(); }

VirtualModbusCounts VirtualModbus::counts() const { return server_->counts(); }

}  // namespace tenter
