// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <umockdev.h>

#include <map>
#include <mutex>
#include <string>

#include "virtual_usb_model.h"

namespace tenter {

class VirtualUsbNode;

/// One device on the bus: its model, the faults it is to meet, and its plug. Each time it is
/// plugged in it gets a new node; what still holds the old one finds it dead for ever, as with the
/// kernel.
///
/// The lock guards the model and is never held across a call of umockdev: such a call waits for the
/// client's memory, and a client that is stopped just then would stop the mechanics too.
class VirtualUsbDevice {
 public:
  VirtualUsbDevice(UMockdevTestbed* testbed, VirtualActuatorSpec spec, int port);
  /// Waits for a client that is being answered; so stopped clients have to be ended first.
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

  /// A transfer as it stands after the device has seen it.
  struct Transfer {
    bool control = false, in = false;
    int status = 0, actual = 0;
    VirtualUsbModel::Time ready{0};  ///< Not to be given back earlier.
    bool mute = false, cut_short = false;
    bool awaits_data = false;  ///< A bulk IN the model has no answer for yet.
  };
  /// `bytes` is the set-up packet and its data, or the data of a bulk endpoint.
  Transfer begin(bool control, bool in, std::span<std::uint8_t> bytes);
  /// Gives a waiting bulk IN what the model has to say by now.
  void fetch(Transfer& transfer, std::span<std::uint8_t> bytes);
  std::vector<std::uint8_t> descriptors() const { return model_->descriptors(); }

 private:
  bool describe(int address, std::string& error);
  bool takeFault(VirtualFault fault, std::optional<std::uint8_t> request);
  int transferControl(std::span<std::uint8_t> buffer, int& actual);
  int transferString(std::uint8_t index, std::span<std::uint8_t> data, int& actual) const;

  struct PassingFault {
    int count;
    std::optional<std::uint8_t> only_request;
  };

  UMockdevTestbed* testbed_;
  const VirtualActuatorSpec spec_;
  const int port_;
  const std::unique_ptr<VirtualUsbModel> model_;

  std::mutex plugging_;  ///< One plug or unplug at a time; guards the next three.
  std::string system_path_;
  std::unique_ptr<VirtualUsbNode> node_;
  std::vector<std::unique_ptr<VirtualUsbNode>> dead_nodes_;

  std::mutex mutex_;  ///< Guards the model and the rest.
  bool plugged_ = false;
  std::map<VirtualFault, PassingFault> faults_;
  std::chrono::microseconds latency_{0};
  std::optional<VirtualUsbModel::Time> unplug_at_;
  long transfers_ = 0;
};

}  // namespace tenter
