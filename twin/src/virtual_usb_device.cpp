// SPDX-License-Identifier: GPL-3.0-or-later
// What becomes of a transfer, and the faults asked for.
#include "virtual_usb_device.h"

#include <algorithm>
#include <cerrno>

#include "virtual_usb_node.h"

namespace tenter {
namespace {

using namespace std::chrono_literals;
constexpr std::size_t kSetupLength = 8;
constexpr std::uint8_t kStandardIn = 0x80, kGetDescriptor = 6, kStringType = 3;
constexpr std::chrono::milliseconds kUnplugDelay = 20ms;

VirtualUsbModel::Time timeNow() { return std::chrono::steady_clock::now().time_since_epoch(); }

bool lasts(VirtualFault fault) {
  for (const VirtualFaultRow& row : virtualFaults()) {
    if (row.fault == fault) return row.lasts;
  }
  return false;
}

}  // namespace

VirtualUsbDevice::Transfer VirtualUsbDevice::begin(bool control, bool in,
                                                   std::span<std::uint8_t> bytes) {
  std::optional<std::uint8_t> code;
  if (control && bytes[0] != kStandardIn) code = bytes[1];
  if (!control && !in && !bytes.empty()) code = bytes[0];
  Transfer transfer;
  transfer.control = control;
  transfer.in = in;
  const std::lock_guard lock(mutex_);
  ++transfers_;
  transfer.ready = timeNow() + latency_;
  if (takeFault(VirtualFault::kUnplugInTransfer, code)) {
    transfer.mute = true;
    unplug_at_ = timeNow() + kUnplugDelay;
  } else if (takeFault(VirtualFault::kMute, code)) {
    transfer.mute = true;
  } else if (takeFault(VirtualFault::kStall, code)) {
    transfer.status = -EPIPE;
  } else if (takeFault(VirtualFault::kProtocolError, code)) {
    transfer.status = -EPROTO;
  } else {
    transfer.cut_short = in && takeFault(VirtualFault::kShortReply, code);
    model_->advanceTo(timeNow());
    if (control) {
      transfer.status = transferControl(bytes, transfer.actual);
      if (transfer.cut_short) transfer.actual /= 2;
    } else if (in) {
      transfer.awaits_data = true;
    } else {
      transfer.status = model_->bulkOut(bytes);
      transfer.actual = transfer.status == 0 ? static_cast<int>(bytes.size()) : 0;
    }
  }
  return transfer;
}

void VirtualUsbDevice::fetch(Transfer& transfer, std::span<std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  if (transfer.ready > timeNow()) return;  // its answer stays in the device until then
  const int status = model_->bulkIn(bytes, transfer.actual);
  if (status == VirtualUsbModel::kNotYet) return;
  transfer.status = status;
  if (transfer.cut_short) transfer.actual /= 2;
  transfer.awaits_data = false;
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

void VirtualUsbDevice::inject(VirtualFault fault, int count,
                              std::optional<std::uint8_t> only_request) {
  const std::lock_guard lock(mutex_);
  if (lasts(fault)) {
    model_->advanceTo(timeNow());
    model_->setCondition(fault, true);
  } else {
    faults_[fault] = {count, only_request};
  }
}

void VirtualUsbDevice::clear(VirtualFault fault) {
  const std::lock_guard lock(mutex_);
  faults_.erase(fault);
  if (!lasts(fault)) return;
  model_->advanceTo(timeNow());
  model_->setCondition(fault, false);
}

void VirtualUsbDevice::setLatency(std::chrono::microseconds latency) {
  const std::lock_guard lock(mutex_);
  latency_ = latency;
}

VirtualActuatorState VirtualUsbDevice::tick() {
  bool due = false;
  {
    const std::lock_guard lock(mutex_);
    due = unplug_at_ && timeNow() >= *unplug_at_;
  }
  if (due) unplug();
  return state();
}

VirtualActuatorState VirtualUsbDevice::state() {
  const std::lock_guard lock(mutex_);
  model_->advanceTo(timeNow());
  VirtualActuatorState state = model_->state();
  state.plugged = plugged_;
  state.transfers = transfers_;
  return state;
}

}  // namespace tenter
