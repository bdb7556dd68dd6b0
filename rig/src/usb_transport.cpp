// SPDX-License-Identifier: GPL-3.0-or-later
#include "usb_transport.h"

#include <optional>

namespace tenter {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kHotplugInterval{100};
constexpr std::chrono::milliseconds kEventWait{20};
constexpr std::chrono::seconds kClosingWait{1};

}  // namespace

Result<std::shared_ptr<UsbTransport>> UsbTransport::open() {
  std::shared_ptr<UsbTransport> self(new UsbTransport);  // NOLINT: the constructor is private
  if (const int status = libusb_init(&self->context_); status != LIBUSB_SUCCESS) {
    return Error{ErrorKind::kHardware, "", "USB",
                 std::string("libusb does not start: ") + libusb_error_name(status),
                 "check that USB is enabled and the file system of devices is there"};
  }
  libusb_hotplug_register_callback(self->context_, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED,
                                   LIBUSB_HOTPLUG_NO_FLAGS, LIBUSB_HOTPLUG_MATCH_ANY,
                                   LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY,
                                   &UsbTransport::arrived, self.get(), nullptr);
  self->thread_ = std::thread([raw = self.get()] { raw->handleEvents(); });
  return self;
}

UsbTransport::~UsbTransport() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
  for (const auto& [device, serial] : serials_) libusb_unref_device(device);
  if (context_ != nullptr) libusb_exit(context_);
}

void UsbTransport::handleEvents() {
  std::unique_lock lock(mutex_);
  std::optional<Clock::time_point> give_up;
  for (;;) {
    wake_.wait_for(lock, kHotplugInterval,
                   [&] { return stopping_ || total_in_flight_ > 0 || !retired_.empty(); });
    if (stopping_ && !give_up) give_up = Clock::now() + kClosingWait;
    const bool idle = total_in_flight_ == 0 && retired_.empty();
    if (give_up && (idle || Clock::now() > *give_up)) return;
    const bool waiting = total_in_flight_ > 0;
    lock.unlock();
    timeval wait{0, waiting ? std::chrono::microseconds(kEventWait).count() : 0};
    libusb_handle_events_timeout_completed(context_, &wait, nullptr);
    lock.lock();
    const std::vector<libusb_device_handle*> closable = takeClosable();
    lock.unlock();
    // Only on this thread, for libusb looks at a handle once more after it called back.
    for (libusb_device_handle* handle : closable) libusb_close(handle);
    lock.lock();
  }
}

std::vector<libusb_device_handle*> UsbTransport::takeClosable() {
  std::vector<libusb_device_handle*> closable;
  std::erase_if(retired_, [&](libusb_device_handle* handle) {
    if (in_flight_[handle] > 0) return false;
    in_flight_.erase(handle);
    closable.push_back(handle);
    return true;
  });
  return closable;
}

void UsbTransport::retire(libusb_device_handle* handle) {
  {
    const std::lock_guard lock(mutex_);
    retired_.push_back(handle);
  }
  wake_.notify_all();
}

void UsbTransport::countIn(libusb_device_handle* handle) {
  {
    const std::lock_guard lock(mutex_);
    ++in_flight_[handle];
    ++total_in_flight_;
  }
  wake_.notify_all();
}

void UsbTransport::countOut(libusb_device_handle* handle) {
  const std::lock_guard lock(mutex_);
  --in_flight_[handle];
  --total_in_flight_;
}

void UsbTransport::completed(libusb_transfer* transfer) {
  const std::unique_ptr<std::shared_ptr<UsbTransfer>> kept(
      static_cast<std::shared_ptr<UsbTransfer>*>(transfer->user_data));
  UsbTransport* self = (*kept)->transport_;
  self->countOut(transfer->dev_handle);
  (*kept)->complete();
}

int UsbTransport::arrived(libusb_context*, libusb_device*, libusb_hotplug_event, void* self) {
  ++static_cast<UsbTransport*>(self)->arrivals_;
  return 0;
}

}  // namespace tenter
