// SPDX-License-Identifier: GPL-3.0-or-later
// The node: ioctls of usbfs as libusb makes them.
#include "virtual_usb_device.h"

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace tenter {
namespace {

using namespace std::chrono_literals;
constexpr std::size_t kSetupLength = 8;
constexpr std::uint8_t kStandardIn = 0x80, kGetDescriptor = 6, kStringType = 3, kIn = 0x80;
constexpr std::chrono::milliseconds kUnplugDelay = 20ms;
constexpr guint kRetry_ms = 1;

VirtualUsbModel::Time timeNow() { return std::chrono::steady_clock::now().time_since_epoch(); }

bool answer(UMockdevIoctlClient* client, long result, int error) {
  umockdev_ioctl_client_complete(client, result, error);
  return true;
}

/// A copy of client memory that goes with the scope.
class ClientData {
 public:
  ClientData(UMockdevIoctlData* from, gsize offset, gsize length)
      : data_(umockdev_ioctl_data_resolve(from, offset, length, nullptr)) {}
  ~ClientData() {
    if (data_ != nullptr) g_object_unref(data_);
  }
  ClientData(const ClientData&) = delete;
  ClientData& operator=(const ClientData&) = delete;
  explicit operator bool() const { return data_ != nullptr; }
  UMockdevIoctlData* get() const { return data_; }
  std::span<std::uint8_t> bytes() const {
    return {data_->data, static_cast<std::size_t>(data_->data_len)};
  }
  template <class T>
  T& as() const {
    return *reinterpret_cast<T*>(data_->data);
  }

 private:
  UMockdevIoctlData* data_;
};

usbdevfs_urb& urbOf(UMockdevIoctlData* data) {
  return *reinterpret_cast<usbdevfs_urb*>(data->data);
}

gboolean answerTryAgain(gpointer client) {
  umockdev_ioctl_client_complete(static_cast<UMockdevIoctlClient*>(client), -1, EAGAIN);
  g_object_unref(client);
  return G_SOURCE_REMOVE;
}

/// libusb would ask without pause while something is in flight: the node of a real device is ready
/// only when there is something to reap, that of a file always.
bool answerTryAgainLater(UMockdevIoctlClient* client) {
  GSource* timer = g_timeout_source_new(kRetry_ms);
  g_source_set_callback(timer, answerTryAgain, g_object_ref(client), nullptr);
  g_source_attach(timer, g_main_context_get_thread_default());
  g_source_unref(timer);
  return true;
}

}  // namespace

bool VirtualUsbDevice::handle(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex_);
  switch (umockdev_ioctl_client_get_request(client)) {
    case USBDEVFS_GET_CAPABILITIES: {
      const ClientData capabilities(umockdev_ioctl_client_get_arg(client), 0, sizeof(guint32));
      if (!capabilities) return answer(client, -1, EFAULT);
      capabilities.as<guint32>() = USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
                                   USBDEVFS_CAP_BULK_CONTINUATION |
                                   USBDEVFS_CAP_REAP_AFTER_DISCONNECT | USBDEVFS_CAP_ZERO_PACKET;
      return answer(client, 0, 0);
    }
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_RELEASEINTERFACE:
    case USBDEVFS_SETCONFIGURATION:
    case USBDEVFS_SETINTERFACE:
    case USBDEVFS_CLEAR_HALT:
    case USBDEVFS_RESETEP:
    case USBDEVFS_RESET:
      return gone_ ? answer(client, -1, ENODEV) : answer(client, 0, 0);
    case USBDEVFS_GETDRIVER:
      return answer(client, -1, ENODATA);
    case USBDEVFS_CONTROL:
      return controlAtOnce(client);
    case USBDEVFS_SUBMITURB:
      return submit(client);
    case USBDEVFS_DISCARDURB:
      return discard(client);
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      return reap(client);
    default:
      return answer(client, -1, ENOTTY);
  }
}

bool VirtualUsbDevice::read(UMockdevIoctlClient* client) {
  const std::lock_guard lock(mutex_);
  const std::vector<std::uint8_t> bytes = model_->descriptors();
  UMockdevIoctlData* target = umockdev_ioctl_client_get_arg(client);
  const std::size_t length = std::min(bytes.size(), static_cast<std::size_t>(target->data_len));
  std::copy_n(bytes.begin(), length, target->data);
  return answer(client, static_cast<long>(length), 0);
}

/// The synchronous control transfer, which libusb does not use but other programs do.
bool VirtualUsbDevice::controlAtOnce(UMockdevIoctlClient* client) {
  if (gone_) return answer(client, -1, ENODEV);
  const ClientData request(umockdev_ioctl_client_get_arg(client), 0, sizeof(usbdevfs_ctrltransfer));
  if (!request) return answer(client, -1, EFAULT);
  const auto& t = request.as<usbdevfs_ctrltransfer>();
  std::vector<std::uint8_t> buffer = {t.bRequestType,
                                      t.bRequest,
                                      static_cast<std::uint8_t>(t.wValue),
                                      static_cast<std::uint8_t>(t.wValue >> 8),
                                      static_cast<std::uint8_t>(t.wIndex),
                                      static_cast<std::uint8_t>(t.wIndex >> 8),
                                      static_cast<std::uint8_t>(t.wLength),
                                      static_cast<std::uint8_t>(t.wLength >> 8)};
  buffer.resize(kSetupLength + t.wLength);
  ++transfers_;
  int actual = 0;
  const int status = transferControl(buffer, actual);
  if (status < 0) return answer(client, -1, -status);
  if (actual > 0) {
    const ClientData data(request.get(), G_STRUCT_OFFSET(usbdevfs_ctrltransfer, data), t.wLength);
    if (!data) return answer(client, -1, EFAULT);
    std::copy_n(buffer.begin() + kSetupLength, actual, data.bytes().begin());
  }
  return answer(client, actual, 0);
}

bool VirtualUsbDevice::submit(UMockdevIoctlClient* client) {
  if (gone_) return answer(client, -1, ENODEV);
  UMockdevIoctlData* data = umockdev_ioctl_data_resolve(umockdev_ioctl_client_get_arg(client), 0,
                                                        sizeof(usbdevfs_urb), nullptr);
  if (data == nullptr) return answer(client, -1, EFAULT);
  const usbdevfs_urb& urb = urbOf(data);
  const bool control = urb.type == USBDEVFS_URB_TYPE_CONTROL;
  const ClientData buffer(data, G_STRUCT_OFFSET(usbdevfs_urb, buffer),
                          static_cast<gsize>(std::max(urb.buffer_length, 0)));
  if ((!control && urb.type != USBDEVFS_URB_TYPE_BULK) || !buffer ||
      (control && buffer.bytes().size() < kSetupLength)) {
    g_object_unref(data);
    return answer(client, -1, EINVAL);
  }
  ++transfers_;
  Urb entry{data};
  perform(entry, buffer.get());
  urbs_.push_back(entry);
  return answer(client, 0, 0);
}

void VirtualUsbDevice::perform(Urb& entry, UMockdevIoctlData* buffer) {
  usbdevfs_urb& urb = urbOf(entry.data);
  const std::span<std::uint8_t> bytes(buffer->data, static_cast<std::size_t>(buffer->data_len));
  const bool control = urb.type == USBDEVFS_URB_TYPE_CONTROL;
  const bool in = control ? (bytes[0] & kIn) != 0 : (urb.endpoint & kIn) != 0;
  std::optional<std::uint8_t> code;
  if (control && bytes[0] != kStandardIn) code = bytes[1];
  if (!control && !in && !bytes.empty()) code = bytes[0];
  urb.status = 0;
  urb.actual_length = 0;
  entry.ready = timeNow() + latency_;
  if (takeFault(VirtualFault::kUnplugInTransfer, code)) {
    entry.mute = true;
    unplug_at_ = timeNow() + kUnplugDelay;
  } else if (takeFault(VirtualFault::kMute, code)) {
    entry.mute = true;
  } else if (takeFault(VirtualFault::kStall, code)) {
    urb.status = -EPIPE;
  } else if (takeFault(VirtualFault::kProtocolError, code)) {
    urb.status = -EPROTO;
  } else {
    entry.cut_short = in && takeFault(VirtualFault::kShortReply, code);
    model_->advanceTo(timeNow());
    if (control) {
      urb.status = transferControl(bytes, urb.actual_length);
      if (entry.cut_short) urb.actual_length /= 2;
    } else if (in) {
      entry.awaits_data = true;
      fetch(entry);
    } else {
      urb.status = model_->bulkOut(bytes);
      urb.actual_length = urb.status == 0 ? urb.buffer_length : 0;
    }
  }
}

/// Gives a waiting bulk IN what the model has to say by now.
void VirtualUsbDevice::fetch(Urb& entry) {
  usbdevfs_urb& urb = urbOf(entry.data);
  const ClientData buffer(entry.data, G_STRUCT_OFFSET(usbdevfs_urb, buffer),
                          static_cast<gsize>(urb.buffer_length));
  if (!buffer) return;
  const int status = model_->bulkIn(buffer.bytes(), urb.actual_length);
  if (status == VirtualUsbModel::kNotYet) return;
  urb.status = status;
  if (entry.cut_short) urb.actual_length /= 2;
  entry.awaits_data = false;
}

bool VirtualUsbDevice::discard(UMockdevIoctlClient* client) {
  UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
  gulong address = 0;
  std::memcpy(&address, argument->data, sizeof(address));
  for (Urb& entry : urbs_) {
    if (entry.data->client_addr != address || entry.cancelled) continue;
    urbOf(entry.data).status = -ENOENT;
    urbOf(entry.data).actual_length = 0;
    entry.mute = entry.awaits_data = false;
    entry.cancelled = true;
    entry.ready = VirtualUsbModel::Time{0};
    return answer(client, 0, 0);
  }
  return answer(client, -1, EINVAL);
}

bool VirtualUsbDevice::reap(UMockdevIoctlClient* client) {
  for (auto entry = urbs_.begin(); entry != urbs_.end(); ++entry) {
    if (gone_ && !entry->cancelled) {
      urbOf(entry->data).status = -ENODEV;
      urbOf(entry->data).actual_length = 0;
    } else {
      if (entry->awaits_data) fetch(*entry);
      if (entry->mute || entry->awaits_data || entry->ready > timeNow()) continue;
    }
    const ClientData slot(umockdev_ioctl_client_get_arg(client), 0, sizeof(gpointer));
    if (!slot) return answer(client, -1, EFAULT);
    umockdev_ioctl_data_set_ptr(slot.get(), 0, entry->data);
    g_object_unref(entry->data);
    urbs_.erase(entry);
    return answer(client, 0, 0);
  }
  if (gone_) return answer(client, -1, ENODEV);
  return urbs_.empty() ? answer(client, -1, EAGAIN) : answerTryAgainLater(client);
}

void VirtualUsbDevice::dropUrbs() {
  for (const Urb& entry : urbs_) g_object_unref(entry.data);
  urbs_.clear();
}

bool VirtualUsbDevice::takeFault(VirtualFault fault, std::optional<std::uint8_t> request) {
  const auto entry = faults_.find(fault);
  if (entry == faults_.end()) return false;
  if (entry->second.only_request && entry->second.only_request != request) return false;
  if (--entry->second.count == 0) faults_.erase(entry);
  return true;
}

int VirtualUsbDevice::transferControl(std::span<std::uint8_t> buffer, int& actual) {
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint16_t>(buffer[at] | buffer[at + 1] << 8);
  };
  const UsbSetup setup{buffer[0], buffer[1], word(2), word(4), word(6)};
  const std::span<std::uint8_t> room = buffer.subspan(kSetupLength);
  const std::span<std::uint8_t> data = room.first(std::min<std::size_t>(room.size(), setup.length));
  actual = 0;
  if (setup.type == kStandardIn && setup.request == kGetDescriptor) {
    if (setup.value >> 8 != kStringType) return -EPIPE;
    return transferString(static_cast<std::uint8_t>(setup.value), data, actual);
  }
  model_->advanceTo(timeNow());
  return model_->control(setup, data, actual);
}

int VirtualUsbDevice::transferString(std::uint8_t index, std::span<std::uint8_t> data,
                                     int& actual) const {
  std::vector<std::uint8_t> bytes = {0, kStringType};
  const std::string texts[] = {"", model_->manufacturer(), model_->product(), spec_.serial};
  if (index == 0) {
    bytes.insert(bytes.end(), {0x09, 0x04});  // English (United States)
  } else if (index < std::size(texts)) {
    for (const char c : texts[index]) bytes.insert(bytes.end(), {static_cast<std::uint8_t>(c), 0});
  } else {
    return -EPIPE;
  }
  bytes[0] = static_cast<std::uint8_t>(bytes.size());
  actual = static_cast<int>(std::min(bytes.size(), data.size()));
  std::copy_n(bytes.begin(), actual, data.begin());
  return 0;
}

}  // namespace tenter
