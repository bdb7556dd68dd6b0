// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/virtual_usb.h"

#include <algorithm>
#include <condition_variable>
#include <set>
#include <thread>

#include "tenter/rig/actuator_driver.h"
#include "virtual_usb_device.h"

namespace tenter {
namespace {

using namespace std::chrono_literals;
constexpr std::chrono::milliseconds kTick = 2ms;
constexpr int kFirstAddress = 10, kLastAddress = 126;
constexpr int kMostDevices = 64;

Error wrongDevice(const VirtualActuatorSpec& spec, std::string reason) {
  return badInput("", "virtual device " + spec.serial, std::move(reason));
}

Result<void> complete(VirtualActuatorSpec& spec) {
  const ActuatorDriverRow* row = findActuatorDriver(spec.driver);
  if (row == nullptr) return wrongDevice(spec, "there is no driver " + spec.driver);
  if (spec.product == 0) spec.product = row->products.front().product;
  const bool known = std::any_of(row->products.begin(), row->products.end(),
                                 [&](const UsbProduct& p) { return p.product == spec.product; });
  if (!known) return wrongDevice(spec, "driver " + spec.driver + " has no such product");
  const bool printable = std::all_of(spec.serial.begin(), spec.serial.end(),
                                     [](char c) { return c > ' ' && c <= '~'; });
  if (spec.serial.empty() || spec.serial.size() > 64 || !printable) {
    return wrongDevice(spec, "its serial number must be 1 to 64 printable characters");
  }
  return {};
}

}  // namespace

const std::vector<VirtualFaultRow>& virtualFaults() {
  static const std::vector<VirtualFaultRow> rows = {
      {VirtualFault::kStall, "stall", false},
      {VirtualFault::kProtocolError, "protocol-error", false},
      {VirtualFault::kShortReply, "short-reply", false},
      {VirtualFault::kMute, "mute", false},
      {VirtualFault::kUnplugInTransfer, "unplug-in-transfer", false},
      {VirtualFault::kKillSwitch, "kill-switch", true},
      {VirtualFault::kUnderVoltage, "under-voltage", true},
      {VirtualFault::kDriverError, "driver-error", true},
      {VirtualFault::kForwardLimit, "forward-limit", true},
      {VirtualFault::kReverseLimit, "reverse-limit", true},
      {VirtualFault::kJammed, "jammed", true},
      {VirtualFault::kSettingsLocked, "settings-locked", true},
  };
  return rows;
}

class VirtualUsb::Bus {
 public:
  explicit Bus(UMockdevTestbed* testbed) : testbed_(testbed) {}
  ~Bus() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_all();
    if (ticker_.joinable()) ticker_.join();
    devices.clear();
    g_object_unref(testbed_);
  }
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  void add(VirtualActuatorSpec spec) {
    const int port = static_cast<int>(devices.size()) + 1;
    devices.push_back(std::make_unique<VirtualUsbDevice>(testbed_, std::move(spec), port));
  }

  Result<void> plug(VirtualUsbDevice& device) {
    const std::lock_guard lock(addresses_);
    const int address = next_address_;
    next_address_ = next_address_ == kLastAddress ? kFirstAddress : next_address_ + 1;
    return device.plug(address);
  }

  void start() {
    ticker_ = std::thread([this] { tick(); });
  }

  void observe(Observer observer) {
    const std::lock_guard lock(observing_);
    observer_ = std::move(observer);
  }

  VirtualUsbDevice& device(int index) const { return *devices.at(static_cast<std::size_t>(index)); }

  std::vector<std::unique_ptr<VirtualUsbDevice>> devices;

 private:
  void tick() {
    std::unique_lock lock(mutex_);
    while (!stopping_) {
      wake_.wait_for(lock, kTick, [this] { return stopping_; });
      lock.unlock();
      {
        const std::lock_guard observing(observing_);
        for (int i = 0; i < static_cast<int>(devices.size()); ++i) {
          const VirtualActuatorState state = device(i).tick();
          if (observer_) observer_(i, state);
        }
      }
      lock.lock();
    }
  }

  UMockdevTestbed* testbed_;
  std::mutex mutex_, observing_, addresses_;
  std::condition_variable wake_;
  bool stopping_ = false;
  Observer observer_;
  int next_address_ = kFirstAddress;
  std::thread ticker_;
};

Result<std::unique_ptr<VirtualUsb>> VirtualUsb::create(std::vector<VirtualActuatorSpec> devices) {
  if (devices.size() > kMostDevices) return badInput("", "virtual bus", "more than 64 devices");
  std::set<std::string> serials;
  for (VirtualActuatorSpec& spec : devices) {
    if (Result<void> checked = complete(spec); !checked) return checked.error();
    if (!serials.insert(spec.serial).second) return wrongDevice(spec, "two have this number");
  }
  UMockdevTestbed* testbed = umockdev_testbed_new();
  auto bus = std::make_unique<Bus>(testbed);
  // Only true once there is a testbed.
  if (umockdev_in_mock_environment() == FALSE) {
    return Error{ErrorKind::kHardware, "", "virtual bus",
                 "this program runs without libumockdev-preload",
                 "start it through VirtualUsb::preload or umockdev-wrapper"};
  }
  for (VirtualActuatorSpec& spec : devices) {
    bus->add(std::move(spec));
    if (Result<void> plugged = bus->plug(*bus->devices.back()); !plugged) return plugged.error();
  }
  bus->start();
  return std::unique_ptr<VirtualUsb>(new VirtualUsb(std::move(bus)));
}

VirtualUsb::VirtualUsb(std::unique_ptr<Bus> bus) : bus_(std::move(bus)) {}
VirtualUsb::~VirtualUsb() = default;

int VirtualUsb::size() const { return static_cast<int>(bus_->devices.size()); }
VirtualActuatorState VirtualUsb::state(int device) const { return bus_->device(device).state(); }
void VirtualUsb::observe(Observer observer) { bus_->observe(std::move(observer)); }

void VirtualUsb::inject(int device, VirtualFault fault, int count,
                        std::optional<std::uint8_t> only_request) {
  require(count > 0, "a fault happens at least once");
  bus_->device(device).inject(fault, count, only_request);
}

void VirtualUsb::clear(int device, VirtualFault fault) { bus_->device(device).clear(fault); }

void VirtualUsb::setLatency(int device, std::chrono::microseconds latency) {
  bus_->device(device).setLatency(latency);
}

void VirtualUsb::unplug(int device) { bus_->device(device).unplug(); }

Result<void> VirtualUsb::replug(int device) { return bus_->plug(bus_->device(device)); }

}  // namespace tenter
