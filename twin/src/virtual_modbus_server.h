// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <poll.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "tenter/twin/virtual_modbus.h"
#include "virtual_modbus_frames.h"

namespace tenter {

/// CLOCK_MONOTONIC [ns].
std::int64_t serverTime_ns();

/// One thread that waits for requests and sends bytes at their time. A derived class owns the
/// descriptors, and stops the thread before they go.
class VirtualModbus::Server {
 public:
  explicit Server(VirtualUnits units);
  virtual ~Server();

  virtual std::string address() const = 0;
  virtual int port() const { return 0; }
  VirtualModbusCounts counts() const;

 protected:
  void startThread();
  void stopThread();

  virtual void addDescriptors(std::vector<pollfd>& entries) const = 0;
  virtual void handleInput(const pollfd& entry) = 0;
  /// Writes; a peer that is gone is no error.
  virtual void output(int descriptor, const Bytes& bytes) = 0;
  virtual void hangUp(int descriptor) = 0;

  void sendAt(std::int64_t time_ns, int descriptor, Bytes bytes);
  void hangUpAt(std::int64_t time_ns, int descriptor);
  /// Forgets what was to be sent there.
  void dropOutput(int descriptor);
  VirtualCell* findCell(int unit) const;

  std::atomic<std::uint64_t> requests_{0}, answers_{0}, early_requests_{0};

 private:
  struct Pending {
    int descriptor;
    Bytes bytes;
    bool hang_up;
  };
  void loop();
  void sendDue();

  VirtualUnits units_;
  std::multimap<std::int64_t, Pending> pending_;  // by time
  int wake_ = -1;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class VirtualModbus::TcpServer : public Server {
 public:
  static Result<std::unique_ptr<Server>> make(VirtualUnits units, const VirtualTcpOptions& options);
  ~TcpServer() override;
  std::string address() const override;
  int port() const override { return port_; }

 private:
  TcpServer(VirtualUnits units, const VirtualTcpOptions& options, int listener, int port);
  void addDescriptors(std::vector<pollfd>& entries) const override;
  void handleInput(const pollfd& entry) override;
  void output(int descriptor, const Bytes& bytes) override;
  void hangUp(int descriptor) override;
  void accept();
  void drop(int descriptor);
  void answer(int descriptor, const ModbusRequest& request);

  std::chrono::nanoseconds turnaround_;
  int listener_, port_;
  std::map<int, Bytes> inputs_;  // by connection
};

class VirtualModbus::RtuServer : public Server {
 public:
  static Result<std::unique_ptr<Server>> make(VirtualUnits units, const VirtualRtuOptions& options);
  ~RtuServer() override;
  std::string address() const override;

 private:
  RtuServer(VirtualUnits units, const VirtualRtuOptions& options);
  void addDescriptors(std::vector<pollfd>& entries) const override;
  void handleInput(const pollfd& entry) override;
  void output(int descriptor, const Bytes& bytes) override;
  void hangUp(int descriptor) override;
  Result<void> open();
  void close();
  void answer(const ModbusRequest& request, std::int64_t begin_ns);
  std::int64_t character_ns() const { return std::int64_t{10'000'000'000} / options_.baud; }

  VirtualRtuOptions options_;
  int master_ = -1;
  int slave_ = -1;  // kept open, else the master would hang up between two clients
  Bytes input_;
  std::int64_t input_begin_ns_ = 0, bus_free_ns_ = 0;
};

}  // namespace tenter
