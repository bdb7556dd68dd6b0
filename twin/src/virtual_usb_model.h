// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tenter/twin/virtual_usb.h"

namespace tenter {

/// The eight bytes that begin a control transfer.
struct UsbSetup {
  std::uint8_t type, request;
  std::uint16_t value, index, length;
};

/// A device behind the virtual bus: its electronics and mechanics, without USB's framing. Time is
/// handed in, so that a test can run a minute in no time. Statuses are 0 or a negative errno, as
/// the kernel puts them into a transfer.
class VirtualUsbModel {
 public:
  using Time = std::chrono::nanoseconds;
  static constexpr int kNotYet = 1;  ///< Of bulkIn(): nothing to say, ask again.

  virtual ~VirtualUsbModel() = default;

  virtual std::vector<std::uint8_t> descriptors() const = 0;  ///< Device and configuration.
  virtual const char* manufacturer() const = 0;
  virtual const char* product() const = 0;

  virtual void powerUp(Time now) = 0;
  virtual void advanceTo(Time now) = 0;
  virtual VirtualActuatorState state() const = 0;
  virtual void setCondition(VirtualFault condition, bool on) = 0;

  /// Vendor request; writes at most data.size() bytes and how many.
  virtual int control(const UsbSetup& setup, std::span<std::uint8_t> data, int& actual) = 0;
  virtual int bulkOut(std::span<const std::uint8_t> data) = 0;
  virtual int bulkIn(std::span<std::uint8_t> data, int& actual) = 0;
};

std::unique_ptr<VirtualUsbModel> makeVirtualTic(const VirtualActuatorSpec& spec);
std::unique_ptr<VirtualUsbModel> makeVirtualLac(const VirtualActuatorSpec& spec);

/// Descriptors of a vendor-specific device with one interface and these bulk endpoints.
std::vector<std::uint8_t> vendorDescriptors(std::uint16_t vendor, std::uint16_t product,
                                            std::uint16_t release,
                                            const std::vector<std::uint8_t>& bulk_endpoints);

}  // namespace tenter
