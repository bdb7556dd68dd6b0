// SPDX-License-Identifier: GPL-3.0-or-later
// Finding a device by serial number or port, opening it, claiming it.
#include <algorithm>
#include <array>
#include <cctype>

#include "usb_transport.h"

namespace tenter {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kInterface = 0;
// So that a mute device does not use up the time in which the others could be asked.
constexpr std::chrono::milliseconds kSerialWait{50};

std::chrono::milliseconds left(Clock::time_point deadline) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
}

/// "1-4.2": bus, then the ports from the root hub on.
std::string portOf(libusb_device* device) {
  std::array<std::uint8_t, 8> ports{};
  const int depth = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string text = std::to_string(libusb_get_bus_number(device));
  for (int i = 0; i < depth; ++i) {
    text += (i == 0 ? "-" : ".") + std::to_string(ports[static_cast<std::size_t>(i)]);
  }
  return text;
}

/// A string descriptor as text; empty unless all of it is printable ASCII.
std::string textOfDescriptor(const std::vector<std::uint8_t>& bytes) {
  constexpr std::uint8_t kStringType = 3;
  std::string text;
  if (bytes.size() < 2 || bytes[1] != kStringType || bytes[0] > bytes.size()) return text;
  for (std::size_t i = 2; i + 1 < bytes[0]; i += 2) {
    if (bytes[i + 1] != 0 || std::isprint(bytes[i]) == 0) return "";
    text += static_cast<char>(bytes[i]);
  }
  return text;
}

ActuatorFault faultOfOpening(int status) {
  switch (status) {
    case LIBUSB_ERROR_ACCESS:
      return ActuatorFault::kAccessDenied;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return ActuatorFault::kUnplugged;
    default:
      return ActuatorFault::kProtocolError;
  }
}

/// All devices on the bus, each with a reference that goes with the list.
class DeviceList {
 public:
  explicit DeviceList(libusb_context* context) {
    const auto count = libusb_get_device_list(context, &list_);
    if (count > 0) devices_.assign(list_, list_ + count);
  }
  ~DeviceList() {
    if (list_ != nullptr) libusb_free_device_list(list_, 1);
  }
  DeviceList(const DeviceList&) = delete;
  DeviceList& operator=(const DeviceList&) = delete;
  const std::vector<libusb_device*>& devices() const { return devices_; }

 private:
  libusb_device** list_ = nullptr;
  std::vector<libusb_device*> devices_;
};

}  // namespace

void UsbTransport::forgetAbsent(const std::vector<libusb_device*>& present) {
  std::erase_if(links_, [](const auto& entry) { return entry.second.expired(); });
  std::erase_if(serials_, [&](const auto& entry) {
    if (std::find(present.begin(), present.end(), entry.first) != present.end()) return false;
    libusb_unref_device(entry.first);
    return true;
  });
}

ActuatorFault UsbTransport::readSerial(UsbLink& link, std::uint8_t index,
                                       Clock::time_point deadline) {
  if (index == 0) return ActuatorFault::kNone;  // it has none
  const auto bell = std::make_shared<UsbBell>();
  const auto transfer = link.submit(UsbRequest::stringDescriptor(index), left(deadline), bell);
  for (unsigned rings = 0; !transfer->done() && Clock::now() < deadline;) {
    rings = bell->wait(rings, deadline);
  }
  if (!transfer->done()) return ActuatorFault::kTimeout;
  link.serial_ = textOfDescriptor(transfer->reply().data);
  return transfer->reply().fault;
}

UsbTransport::Connection UsbTransport::tryDevice(libusb_device* device, const Wanted& wanted,
                                                 Clock::time_point deadline) {
  libusb_device_descriptor descriptor{};
  if (libusb_get_device_descriptor(device, &descriptor) != LIBUSB_SUCCESS ||
      descriptor.idVendor != wanted.vendor ||
      std::find(wanted.products.begin(), wanted.products.end(), descriptor.idProduct) ==
          wanted.products.end()) {
    return {};
  }
  if (wanted.serial.empty() && portOf(device) != wanted.port) return {};
  const auto known = serials_.find(device);
  if (!wanted.serial.empty() && known != serials_.end() && known->second != wanted.serial)
    return {};

  const std::string where = "USB " + portOf(device);
  libusb_device_handle* handle = nullptr;
  if (const int status = libusb_open(device, &handle); status != LIBUSB_SUCCESS) {
    return {nullptr, faultOfOpening(status), where + ": " + libusb_error_name(status)};
  }
  auto link = std::make_shared<UsbLink>(shared_from_this(), handle, descriptor.idProduct);
  const Clock::time_point patience = std::min(deadline, Clock::now() + kSerialWait);
  if (const ActuatorFault fault = readSerial(*link, descriptor.iSerialNumber, patience);
      fault != ActuatorFault::kNone) {
    return {nullptr, fault, where + ": reading its serial number"};
  }
  if (known == serials_.end()) serials_.emplace(libusb_ref_device(device), link->serial());
  if (!wanted.serial.empty() && link->serial() != wanted.serial) return {};
  if (const int status = libusb_claim_interface(handle, kInterface); status != LIBUSB_SUCCESS) {
    return {nullptr, faultOfOpening(status),
            where + ": claiming its interface: " + libusb_error_name(status)};
  }
  links_[device] = link;
  return {link, ActuatorFault::kNone, ""};
}

UsbTransport::Connection UsbTransport::connect(const Wanted& wanted, Clock::time_point deadline) {
  const std::lock_guard lock(connect_mutex_);
  const DeviceList list(context_);
  forgetAbsent(list.devices());
  // A device that cannot be asked may be the one: what it answered says more than "not found".
  Connection result{nullptr, ActuatorFault::kUnplugged,
                    wanted.serial.empty() ? "nothing at port " + wanted.port
                                          : "no device with serial number " + wanted.serial};
  for (libusb_device* device : list.devices()) {
    if (const auto entry = links_.find(device); entry != links_.end() && !entry->second.expired()) {
      continue;
    }
    Connection attempt = tryDevice(device, wanted, deadline);
    if (attempt.link != nullptr) return attempt;
    if (attempt.fault != ActuatorFault::kNone) result = std::move(attempt);
  }
  return result;
}

}  // namespace tenter
