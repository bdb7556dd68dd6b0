// SPDX-License-Identifier: GPL-3.0-or-later
// The device's entries in sysfs; plugging and unplugging.
#include <array>
#include <cstdio>

#include "virtual_usb_node.h"

namespace tenter {
namespace {

VirtualUsbModel::Time timeNow() { return std::chrono::steady_clock::now().time_since_epoch(); }

std::unique_ptr<VirtualUsbModel> makeModel(const VirtualActuatorSpec& spec) {
  return spec.driver == "lac" ? makeVirtualLac(spec) : makeVirtualTic(spec);
}

std::string formatted(const char* format, int a, int b = 0) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), format, a, b);
  return text.data();
}

std::string hexadecimal(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += formatted("%02X", byte);
  return text;
}

}  // namespace

std::vector<std::uint8_t> vendorDescriptors(std::uint16_t vendor, std::uint16_t product,
                                            std::uint16_t release,
                                            const std::vector<std::uint8_t>& bulk_endpoints) {
  const auto low = [](int word) { return static_cast<std::uint8_t>(word); };
  const auto high = [](int word) { return static_cast<std::uint8_t>(word >> 8); };
  const auto total = static_cast<int>(9 + 9 + 7 * bulk_endpoints.size());
  std::vector<std::uint8_t> bytes = {18,
                                     1,
                                     0x00,
                                     0x02,
                                     0,
                                     0,
                                     0,
                                     8,  // USB 2.0, class by interface, 8 bytes on endpoint 0
                                     low(vendor),
                                     high(vendor),
                                     low(product),
                                     high(product),
                                     low(release),
                                     high(release),
                                     1,
                                     2,
                                     3,
                                     1,  // strings; one configuration
                                     9,
                                     2,
                                     low(total),
                                     high(total),
                                     1,
                                     1,
                                     0,
                                     0xC0,
                                     50,  // self-powered, 100 mA
                                     9,
                                     4,
                                     0,
                                     0,
                                     low(static_cast<int>(bulk_endpoints.size())),
                                     0xFF,
                                     0xFF,
                                     0xFF,
                                     0};
  for (const std::uint8_t endpoint : bulk_endpoints) {
    bytes.insert(bytes.end(), {7, 5, endpoint, 2, 64, 0, 0});
  }
  return bytes;
}

VirtualUsbDevice::VirtualUsbDevice(UMockdevTestbed* testbed, VirtualActuatorSpec spec, int port)
    : testbed_(testbed), spec_(std::move(spec)), port_(port), model_(makeModel(spec_)) {}

VirtualUsbDevice::~VirtualUsbDevice() { unplug(); }

bool VirtualUsbDevice::describe(int address, std::string& error) {
  const std::vector<std::uint8_t> bytes = model_->descriptors();
  const int vendor = bytes[8] | bytes[9] << 8;
  const int product = bytes[10] | bytes[11] << 8;
  const std::string port = formatted("1-%d", port_);
  const std::string path = "/devices/pci0000:00/usb1/" + port;
  const auto attribute = [](const std::string& name, const std::string& value) {
    return "A: " + name + "=" + value + "\\n\n";
  };
  std::string text = "P: " + path + "\nN: bus/usb/" + formatted("001/%03d", address) + "\n";
  text += "E: SUBSYSTEM=usb\nE: DRIVER=usb\nE: DEVTYPE=usb_device\nE: BUSNUM=001\n";
  text += formatted("E: DEVNUM=%03d\nE: DEVNAME=/dev/bus/usb/001/%03d\n", address, address);
  text += formatted("E: PRODUCT=%x/%x/100\n", vendor, product);
  text += attribute("busnum", "1") + attribute("devnum", std::to_string(address));
  text += attribute("bConfigurationValue", "1") + attribute("speed", "12");
  text += attribute("idVendor", formatted("%04x", vendor));
  text += attribute("idProduct", formatted("%04x", product));
  text += attribute("bcdDevice", formatted("%02x%02x", bytes[13], bytes[12]));
  text += attribute("serial", spec_.serial);
  text += "H: descriptors=" + hexadecimal(bytes) + "\n\n";
  text += "P: " + path + "/" + port + ":1.0\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\n";
  text += attribute("bInterfaceNumber", "00") + attribute("bInterfaceClass", "ff");
  system_path_ = "/sys" + path;
  GError* problem = nullptr;
  if (umockdev_testbed_add_from_string(testbed_, text.c_str(), &problem)) return true;
  error = problem->message;
  g_error_free(problem);
  return false;
}

Result<void> VirtualUsbDevice::plug(int address) {
  const std::lock_guard plugging(plugging_);
  if (node_ != nullptr) return {};
  {
    const std::lock_guard lock(mutex_);
    model_->advanceTo(timeNow());
    model_->powerUp(timeNow());
    unplug_at_.reset();
    plugged_ = true;
  }
  node_ = std::make_unique<VirtualUsbNode>(*this, testbed_,
                                           formatted("/dev/bus/usb/001/%03d", address));
  std::string reason = node_->attach();
  if (reason.empty() && describe(address, reason)) {
    umockdev_testbed_uevent(testbed_, system_path_.c_str(), "add");
    return {};
  }
  node_.reset();
  const std::lock_guard lock(mutex_);
  plugged_ = false;
  return Error{ErrorKind::kHardware, "", "virtual device " + spec_.serial,
               "it cannot be plugged in: " + reason, ""};
}

void VirtualUsbDevice::unplug() {
  const std::lock_guard plugging(plugging_);
  if (node_ == nullptr) return;
  node_->kill();
  {
    const std::lock_guard lock(mutex_);
    model_->advanceTo(timeNow());
    unplug_at_.reset();
    plugged_ = false;
  }
  umockdev_testbed_uevent(testbed_, system_path_.c_str(), "remove");
  node_->detach();
  // The interface by itself: its link among the bus' devices outlives the removal of its parent.
  umockdev_testbed_remove_device(testbed_, (system_path_ + formatted("/1-%d:1.0", port_)).c_str());
  umockdev_testbed_remove_device(testbed_, system_path_.c_str());
  // Not freed: a client may still be answered, and may be stopped while it is.
  dead_nodes_.push_back(std::move(node_));
}

}  // namespace tenter
