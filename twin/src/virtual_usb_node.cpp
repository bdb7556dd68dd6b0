// SPDX-License-Identifier: GPL-3.0-or-later
#include "virtual_usb_node.h"

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace tenter {
namespace {

constexpr std::size_t kSetupLength = 8;
constexpr std::uint8_t kIn = 0x80;
constexpr guint kRetry_ms = 1;

VirtualUsbModel::Time timeNow() { return std::chrono::steady_clock::now().time_since_epoch(); }

bool answer(UMockdevIoctlClient* client, long result, int error) {
  umockdev_ioctl_client_complete(client, result, error);
  return true;
}

std::span<std::uint8_t> bytesOf(UMockdevIoctlData* data) {
  return {data->data, static_cast<std::size_t>(data->data_len)};
}

usbdevfs_urb& urbOf(UMockdevIoctlData* data) {
  return *reinterpret_cast<usbdevfs_urb*>(data->data);
}

/// A copy of client memory that goes with the scope; empty if the client has gone.
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
  std::span<std::uint8_t> bytes() const { return bytesOf(data_); }
  /// A reference of the caller's own.
  UMockdevIoctlData* keep() const { return static_cast<UMockdevIoctlData*>(g_object_ref(data_)); }
  template <class T>
  T& as() const {
    return *reinterpret_cast<T*>(data_->data);
  }

 private:
  UMockdevIoctlData* data_;
};

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

gboolean onIoctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, VirtualUsbNode* node) {
  return node->handle(client) ? TRUE : FALSE;
}

gboolean onRead(UMockdevIoctlBase*, UMockdevIoctlClient* client, VirtualUsbNode* node) {
  return node->read(client) ? TRUE : FALSE;
}

void onVanished(UMockdevIoctlBase*, UMockdevIoctlClient* client, VirtualUsbNode* node) {
  node->forget(client);
}

}  // namespace

VirtualUsbNode::VirtualUsbNode(VirtualUsbDevice& device, UMockdevTestbed* testbed, std::string path)
    : device_(device), testbed_(testbed), path_(std::move(path)) {}

VirtualUsbNode::~VirtualUsbNode() {
  detach();
  if (handler_ != nullptr) g_signal_handlers_disconnect_by_data(handler_, this);
  g_clear_object(&handler_);
  const std::lock_guard answering(answering_);
  for (const Urb& urb : urbs_) drop(urb);
}

std::string VirtualUsbNode::attach() {
  handler_ = umockdev_ioctl_base_new();
  g_object_connect(handler_, "signal-after::handle-ioctl", G_CALLBACK(onIoctl), this,
                   "signal-after::handle-read", G_CALLBACK(onRead), this,
                   "signal-after::client-vanished", G_CALLBACK(onVanished), this, nullptr);
  GError* problem = nullptr;
  attached_ = umockdev_testbed_attach_ioctl(testbed_, path_.c_str(), handler_, &problem) != FALSE;
  if (attached_) return "";
  std::string reason = problem->message;
  g_error_free(problem);
  return reason;
}

void VirtualUsbNode::detach() {
  if (attached_) umockdev_testbed_detach_ioctl(testbed_, path_.c_str(), nullptr);
  attached_ = false;
}

void VirtualUsbNode::drop(const Urb& urb) {
  g_object_unref(urb.owner);
  g_object_unref(urb.buffer);
  g_object_unref(urb.data);
}

/// With a client go its transfers: the next one must not be handed addresses of its memory.
void VirtualUsbNode::forget(UMockdevIoctlClient* client) {
  const std::lock_guard answering(answering_);
  std::erase_if(urbs_, [&](const Urb& urb) {
    if (urb.owner != client) return false;
    drop(urb);
    return true;
  });
}

bool VirtualUsbNode::handle(UMockdevIoctlClient* client) {
  const std::lock_guard answering(answering_);
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
      return dead_ ? answer(client, -1, ENODEV) : answer(client, 0, 0);
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

/// The descriptors, for programs that do not look for them in sysfs.
bool VirtualUsbNode::read(UMockdevIoctlClient* client) {
  const std::lock_guard answering(answering_);
  const std::vector<std::uint8_t> bytes = device_.descriptors();
  UMockdevIoctlData* target = umockdev_ioctl_client_get_arg(client);
  const std::size_t length = std::min(bytes.size(), static_cast<std::size_t>(target->data_len));
  std::copy_n(bytes.begin(), length, target->data);
  return answer(client, static_cast<long>(length), 0);
}

/// The synchronous control transfer, which libusb does not use but other programs do.
bool VirtualUsbNode::controlAtOnce(UMockdevIoctlClient* client) {
  if (dead_) return answer(client, -1, ENODEV);
  const ClientData request(umockdev_ioctl_client_get_arg(client), 0, sizeof(usbdevfs_ctrltransfer));
  if (!request) return answer(client, -1, EFAULT);
  const auto& t = request.as<usbdevfs_ctrltransfer>();
  const auto low = [](int word) { return static_cast<std::uint8_t>(word); };
  const auto high = [](int word) { return static_cast<std::uint8_t>(word >> 8); };
  std::vector<std::uint8_t> buffer = {t.bRequestType, t.bRequest,     low(t.wValue),
                                      high(t.wValue), low(t.wIndex),  high(t.wIndex),
                                      low(t.wLength), high(t.wLength)};
  buffer.resize(kSetupLength + t.wLength);
  const VirtualUsbDevice::Transfer done = device_.begin(true, (t.bRequestType & kIn) != 0, buffer);
  if (done.mute) return answer(client, -1, ETIMEDOUT);
  if (done.status < 0) return answer(client, -1, -done.status);
  if (done.actual > 0) {
    const ClientData data(request.get(), G_STRUCT_OFFSET(usbdevfs_ctrltransfer, data), t.wLength);
    if (!data) return answer(client, -1, EFAULT);
    std::copy_n(buffer.begin() + kSetupLength, done.actual, data.bytes().begin());
  }
  return answer(client, done.actual, 0);
}

bool VirtualUsbNode::submit(UMockdevIoctlClient* client) {
  if (dead_) return answer(client, -1, ENODEV);
  const ClientData data(umockdev_ioctl_client_get_arg(client), 0, sizeof(usbdevfs_urb));
  if (!data) return answer(client, -1, EFAULT);
  auto& urb = data.as<usbdevfs_urb>();
  const bool control = urb.type == USBDEVFS_URB_TYPE_CONTROL;
  const ClientData buffer(data.get(), G_STRUCT_OFFSET(usbdevfs_urb, buffer),
                          static_cast<gsize>(std::max(urb.buffer_length, 0)));
  if ((!control && urb.type != USBDEVFS_URB_TYPE_BULK) || !buffer ||
      (control && buffer.bytes().size() < kSetupLength)) {
    return answer(client, -1, EINVAL);
  }
  const std::uint8_t direction = control ? buffer.bytes()[0] : urb.endpoint;
  const VirtualUsbDevice::Transfer transfer =
      device_.begin(control, (direction & kIn) != 0, buffer.bytes());
  // Held: a client that goes unseen must not leave its address, and its transfers, to the next.
  auto* owner = static_cast<UMockdevIoctlClient*>(g_object_ref(client));
  urbs_.push_back({owner, data.keep(), buffer.keep(), transfer});
  return answer(client, 0, 0);
}

bool VirtualUsbNode::discard(UMockdevIoctlClient* client) {
  UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
  gulong address = 0;
  std::memcpy(&address, argument->data, sizeof(address));
  const auto urb = std::find_if(urbs_.begin(), urbs_.end(), [&](const Urb& entry) {
    return entry.owner == client && entry.data->client_addr == address && !entry.cancelled;
  });
  if (urb == urbs_.end()) return answer(client, -1, EINVAL);
  urb->cancelled = true;
  urb->transfer.status = -ENOENT;
  urb->transfer.actual = 0;
  return answer(client, 0, 0);
}

bool VirtualUsbNode::isReady(Urb& urb) {
  VirtualUsbDevice::Transfer& transfer = urb.transfer;
  if (urb.cancelled) return true;
  if (dead_) {
    transfer.status = -ENODEV;
    transfer.actual = 0;
    return true;
  }
  if (transfer.awaits_data) device_.fetch(transfer, bytesOf(urb.buffer));
  return !transfer.mute && !transfer.awaits_data && transfer.ready <= timeNow();
}

bool VirtualUsbNode::reap(UMockdevIoctlClient* client) {
  bool pending = false;
  for (auto urb = urbs_.begin(); urb != urbs_.end(); ++urb) {
    if (urb->owner != client) continue;
    pending = true;
    if (!isReady(*urb)) continue;
    const ClientData slot(umockdev_ioctl_client_get_arg(client), 0, sizeof(gpointer));
    if (!slot) return answer(client, -1, EFAULT);
    urbOf(urb->data).status = urb->transfer.status;
    urbOf(urb->data).actual_length = urb->transfer.actual;
    umockdev_ioctl_data_set_ptr(slot.get(), 0, urb->data);
    drop(*urb);
    urbs_.erase(urb);
    return answer(client, 0, 0);
  }
  if (dead_) return answer(client, -1, ENODEV);
  return pending ? answerTryAgainLater(client) : answer(client, -1, EAGAIN);
}

}  // namespace tenter
