// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <umockdev.h>

#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "virtual_usb_model.h"

namespace tenter {

/// One device as the kernel shows it: a node that answers the ioctls of usbfs, and the entries of
/// sysfs. The model and all else here is guarded by one lock; calls of umockdev that may wait for
/// its thread are made without it.
class VirtualUsbDevice {
 public:
  VirtualUsbDevice(UMockdevTestbed* testbed, VirtualActuatorSpec spec, int port);
  ~VirtualUsbDevice();
  VirtualUsbDevice(const VirtualUsbDevice&) = delete;
  VirtualUsbDevice& operator=(const VirtualUsbDevice&) = delete;

  Result<void> plug(int address);
  void unplug();

  void inject(VirtualFault fault, int count, std::optional<std::uint8_t> only_request);
  void clear(VirtualFault fault);
  void setLatency(std::chrono::microseconds latency);
  /// Moves the mechanics on to now; unplugs if a transfer was to end so.
  VirtualActuatorState tick();
  VirtualActuatorState state();

  /// Answers one ioctl, or keeps the client waiting for a millisecond.
  bool handle(UMockdevIoctlClient* client);
  /// read() of the node: the descriptors.
  bool read(UMockdevIoctlClient* client);

 private:
  struct Urb {
    UMockdevIoctlData* data;
    VirtualUsbModel::Time ready{0};
    bool mute = false, cancelled = false;
    bool awaits_data = false;  ///< A bulk IN the model has no answer for yet.
    bool cut_short = false;
  };
  struct PassingFault {
    int count;
    std::optional<std::uint8_t> only_request;
  };

  bool describe(int address, std::string& error);
  bool submit(UMockdevIoctlClient* client);
  bool discard(UMockdevIoctlClient* client);
  bool reap(UMockdevIoctlClient* client);
  bool controlAtOnce(UMockdevIoctlClient* client);
  bool takeFault(VirtualFault fault, std::optional<std::uint8_t> request);
  int transferControl(std::span<std::uint8_t> buffer, int& actual);
  int transferString(std::uint8_t index, std::span<std::uint8_t> data, int& actual) const;
  void perform(Urb& urb, UMockdevIoctlData* buffer);
  void fetch(Urb& urb);
  void dropUrbs();

  UMockdevTestbed* testbed_;
  const VirtualActuatorSpec spec_;
  const int port_;
  std::string node_, system_path_;
  std::mutex plugging_;  ///< One plug or unplug at a time.
  std::mutex mutex_;
  std::unique_ptr<VirtualUsbModel> model_;
  UMockdevIoctlBase* handler_ = nullptr;
  bool gone_ = true;
  std::deque<Urb> urbs_;
  std::map<VirtualFault, PassingFault> faults_;
  std::chrono::microseconds latency_{0};
  std::optional<VirtualUsbModel::Time> unplug_at_;
  long transfers_ = 0;
};

}  // namespace tenter
