// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <libusb-1.0/libusb.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tenter/rig/usb_exchange.h"

namespace tenter {

class UsbTransport;

/// Rings when any of the transfers that carry it completes.
class UsbBell {
 public:
  void ring();
  /// Waits until it rang since `seen`, or `deadline`; returns the new count.
  unsigned wait(unsigned seen, std::chrono::steady_clock::time_point deadline);

 private:
  std::mutex mutex_;
  std::condition_variable rang_;
  unsigned count_ = 0;
};

/// A transfer on its way. Owned jointly by who asked and by libusb until it completes, so that an
/// answer that comes after everybody left finds its memory.
class UsbTransfer {
 public:
  UsbTransfer(UsbRequest request, std::shared_ptr<UsbBell> bell);
  ~UsbTransfer();
  UsbTransfer(const UsbTransfer&) = delete;
  UsbTransfer& operator=(const UsbTransfer&) = delete;

  bool done() const { return done_.load(std::memory_order_acquire); }
  /// Precondition: done().
  const UsbReply& reply() const { return reply_; }
  const UsbRequest& request() const { return request_; }
  void cancel();

 private:
  friend class UsbLink;
  friend class UsbTransport;
  void finish(ActuatorFault fault);
  void complete();
  std::size_t room() const;

  UsbRequest request_;
  std::shared_ptr<UsbBell> bell_;
  UsbTransport* transport_ = nullptr;  ///< Set while submitted.
  libusb_transfer* transfer_;
  std::vector<std::uint8_t> buffer_;
  UsbReply reply_;
  std::atomic<bool> done_{false};
};

/// One opened device. Letting go of it cancels what is pending and closes it as soon as nothing is.
class UsbLink {
 public:
  UsbLink(std::shared_ptr<UsbTransport> transport, libusb_device_handle* handle,
          std::uint16_t product);
  ~UsbLink();
  UsbLink(const UsbLink&) = delete;
  UsbLink& operator=(const UsbLink&) = delete;

  /// Empty if the device has none.
  const std::string& serial() const { return serial_; }
  std::uint16_t product() const { return product_; }
  libusb_device* device() const { return libusb_get_device(handle_); }

  /// Never blocks. A transfer that cannot even be submitted is returned as done, with its fault.
  std::shared_ptr<UsbTransfer> submit(UsbRequest request, std::chrono::milliseconds timeout,
                                      std::shared_ptr<UsbBell> bell);
  /// Cancels all that is pending; each completes with kPreempted. From any thread.
  void cancelAll();

 private:
  friend class UsbTransport;
  std::shared_ptr<UsbTransport> transport_;
  libusb_device_handle* handle_;
  std::string serial_;
  std::uint16_t product_;
  std::mutex mutex_;
  std::vector<std::weak_ptr<UsbTransfer>> pending_;
};

/// libusb with one thread that handles its events. The thread sleeps while nothing is in flight,
/// but for a look at plugging and unplugging every 100 ms.
class UsbTransport : public std::enable_shared_from_this<UsbTransport> {
 public:
  static Result<std::shared_ptr<UsbTransport>> open();
  ~UsbTransport();
  UsbTransport(const UsbTransport&) = delete;
  UsbTransport& operator=(const UsbTransport&) = delete;

  struct Wanted {
    std::uint16_t vendor;
    std::vector<std::uint16_t> products;
    std::string serial, port;  ///< The serial number, or if empty the port.
  };
  struct Connection {
    std::shared_ptr<UsbLink> link;  ///< Null with a fault.
    ActuatorFault fault = ActuatorFault::kNone;
    std::string detail;
  };
  /// Looks for the device, opens it and claims interface 0. Devices with a link are not looked at.
  Connection connect(const Wanted& wanted, std::chrono::steady_clock::time_point deadline);

  /// Grows with each arrival of a device.
  unsigned arrivals() const { return arrivals_; }

 private:
  friend class UsbLink;
  friend class UsbTransfer;
  UsbTransport() = default;
  void handleEvents();
  std::vector<libusb_device_handle*> takeClosable();
  void retire(libusb_device_handle* handle);
  void countIn(libusb_device_handle* handle);
  void countOut(libusb_device_handle* handle);
  static void LIBUSB_CALL completed(libusb_transfer* transfer);
  static int LIBUSB_CALL arrived(libusb_context*, libusb_device*, libusb_hotplug_event, void* self);
  void forgetAbsent(const std::vector<libusb_device*>& present);
  Connection tryDevice(libusb_device* device, const Wanted& wanted,
                       std::chrono::steady_clock::time_point deadline);
  ActuatorFault readSerial(UsbLink& link, std::uint8_t index,
                           std::chrono::steady_clock::time_point deadline);

  libusb_context* context_ = nullptr;
  std::thread thread_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::map<libusb_device_handle*, int> in_flight_;  ///< Of each open handle.
  int total_in_flight_ = 0;
  std::vector<libusb_device_handle*> retired_;
  std::mutex connect_mutex_;
  std::map<libusb_device*, std::string> serials_;  ///< Known ones; holds a reference on each.
  std::map<libusb_device*, std::weak_ptr<UsbLink>> links_;
  std::atomic<unsigned> arrivals_{0};
};

}  // namespace tenter
