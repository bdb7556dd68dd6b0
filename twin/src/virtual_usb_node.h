// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <umockdev.h>

#include <atomic>
#include <deque>
#include <mutex>
#include <string>

#include "virtual_usb_device.h"

namespace tenter {

/// The file below /dev/bus/usb for as long as a device is plugged in: answers the ioctls of usbfs
/// as libusb makes them. All but kill() runs on umockdev's thread.
class VirtualUsbNode {
 public:
  VirtualUsbNode(VirtualUsbDevice& device, UMockdevTestbed* testbed, std::string path);
  ~VirtualUsbNode();
  VirtualUsbNode(const VirtualUsbNode&) = delete;
  VirtualUsbNode& operator=(const VirtualUsbNode&) = delete;

  /// Empty if clients can now open it, else what went wrong.
  std::string attach();
  /// From now on everything answers that there is no such device.
  void kill() { dead_ = true; }
  /// No new clients; those that have it open are still answered.
  void detach();

  bool handle(UMockdevIoctlClient* client);
  bool read(UMockdevIoctlClient* client);
  void forget(UMockdevIoctlClient* client);

 private:
  struct Urb {
    UMockdevIoctlClient* owner;
    UMockdevIoctlData *data, *buffer;
    VirtualUsbDevice::Transfer transfer;
    bool cancelled = false;
  };

  bool submit(UMockdevIoctlClient* client);
  bool discard(UMockdevIoctlClient* client);
  bool reap(UMockdevIoctlClient* client);
  bool controlAtOnce(UMockdevIoctlClient* client);
  bool isReady(Urb& urb);
  static void drop(const Urb& urb);

  VirtualUsbDevice& device_;
  UMockdevTestbed* testbed_;
  const std::string path_;
  UMockdevIoctlBase* handler_ = nullptr;
  bool attached_ = false;
  std::atomic<bool> dead_{false};
  std::mutex answering_;  ///< Held while a client is answered.
  std::deque<Urb> urbs_;
};

}  // namespace tenter
