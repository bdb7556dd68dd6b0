// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <stdexcept>

#include "usb_transport.h"

namespace tenter {
namespace {

constexpr std::size_t kSetup = LIBUSB_CONTROL_SETUP_SIZE;
constexpr unsigned kDrain_ms = 3;  // a full-speed device answers within one frame of 1 ms

ActuatorFault faultOf(libusb_transfer_status status) {
  switch (status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return ActuatorFault::kNone;
    case LIBUSB_TRANSFER_TIMED_OUT:
      return ActuatorFault::kTimeout;
    case LIBUSB_TRANSFER_CANCELLED:
      return ActuatorFault::kPreempted;
    case LIBUSB_TRANSFER_STALL:
      return ActuatorFault::kStall;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return ActuatorFault::kUnplugged;
    case LIBUSB_TRANSFER_ERROR:
    case LIBUSB_TRANSFER_OVERFLOW:
      break;
  }
  return ActuatorFault::kProtocolError;
}

}  // namespace

void UsbBell::ring() {
  // Under the lock: a waiter that has looked and not yet slept would miss it otherwise.
  const std::lock_guard lock(mutex_);
  ++count_;
  rang_.notify_all();
}

unsigned UsbBell::wait(unsigned seen, std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  rang_.wait_until(lock, deadline, [&] { return count_ != seen; });
  return count_;
}

UsbTransfer::UsbTransfer(UsbRequest request, std::shared_ptr<UsbBell> bell)
    : request_(std::move(request)), bell_(std::move(bell)), transfer_(libusb_alloc_transfer(0)) {
  if (transfer_ == nullptr) throw std::bad_alloc();
}

UsbTransfer::~UsbTransfer() { libusb_free_transfer(transfer_); }

std::size_t UsbTransfer::room() const {
  return static_cast<std::size_t>(std::max(request_.reply_length, request_.max_reply_length));
}

void UsbTransfer::cancel() {
  if (!done()) libusb_cancel_transfer(transfer_);
}

void UsbTransfer::finish(ActuatorFault fault) {
  reply_.fault = fault;
  if (fault != ActuatorFault::kNone) reply_.data.clear();
  done_.store(true, std::memory_order_release);
  bell_->ring();
}

void UsbTransfer::complete() {
  ActuatorFault fault = faultOf(transfer_->status);
  const auto actual = static_cast<std::size_t>(std::max(transfer_->actual_length, 0));
  if (fault == ActuatorFault::kTimeout && request_.silence_is_answer) fault = ActuatorFault::kNone;
  if (fault == ActuatorFault::kNone) {
    const std::size_t offset = request_.endpoint == 0 ? kSetup : 0;
    const std::size_t wanted = request_.out.empty()
                                   ? static_cast<std::size_t>(request_.reply_length)
                                   : request_.out.size();
    if (actual < wanted) fault = ActuatorFault::kShortReply;
    if (request_.out.empty()) {
      const std::size_t length = std::min(actual, buffer_.size() - offset);
      reply_.data.assign(buffer_.begin() + static_cast<std::ptrdiff_t>(offset),
                         buffer_.begin() + static_cast<std::ptrdiff_t>(offset + length));
    }
  }
  finish(fault);
}

UsbLink::UsbLink(std::shared_ptr<UsbTransport> transport, libusb_device_handle* handle,
                 std::uint16_t product)
    : transport_(std::move(transport)), handle_(handle), product_(product) {}

UsbLink::~UsbLink() {
  cancelAll();
  transport_->retire(handle_);
}

void UsbLink::cancelAll() {
  const std::lock_guard lock(mutex_);
  for (const std::weak_ptr<UsbTransfer>& entry : pending_) {
    if (const auto transfer = entry.lock()) transfer->cancel();
  }
}

std::shared_ptr<UsbTransfer> UsbLink::submit(UsbRequest request, std::chrono::milliseconds timeout,
                                             std::shared_ptr<UsbBell> bell) {
  auto transfer = std::make_shared<UsbTransfer>(std::move(request), std::move(bell));
  transfer->transport_ = transport_.get();
  const UsbRequest& wanted = transfer->request_;
  // For libusb 0 means to wait for ever.
  unsigned timeout_ms = static_cast<unsigned>(std::max<std::int64_t>(timeout.count(), 1));
  if (wanted.silence_is_answer) timeout_ms = std::min(timeout_ms, kDrain_ms);
  // libusb owns this second reference until it calls back.
  auto kept = std::make_unique<std::shared_ptr<UsbTransfer>>(transfer);
  if (wanted.endpoint == 0) {
    transfer->buffer_.resize(kSetup + transfer->room());
    libusb_fill_control_setup(transfer->buffer_.data(), wanted.type, wanted.code, wanted.value,
                              wanted.index, static_cast<std::uint16_t>(transfer->room()));
    libusb_fill_control_transfer(transfer->transfer_, handle_, transfer->buffer_.data(),
                                 &UsbTransport::completed, kept.get(), timeout_ms);
  } else {
    transfer->buffer_ =
        wanted.out.empty() ? std::vector<std::uint8_t>(transfer->room()) : wanted.out;
    libusb_fill_bulk_transfer(transfer->transfer_, handle_, wanted.endpoint,
                              transfer->buffer_.data(), static_cast<int>(transfer->buffer_.size()),
                              &UsbTransport::completed, kept.get(), timeout_ms);
  }
  const std::lock_guard lock(mutex_);
  std::erase_if(pending_, [](const auto& entry) { return entry.expired(); });
  pending_.push_back(transfer);
  transport_->countIn(handle_);
  const int status = libusb_submit_transfer(transfer->transfer_);
  if (status == LIBUSB_SUCCESS) {
    static_cast<void>(kept.release());  // NOLINT: taken back in UsbTransport::completed
  } else {
    transport_->countOut(handle_);
    transfer->finish(status == LIBUSB_ERROR_NO_DEVICE ? ActuatorFault::kUnplugged
                                                      : ActuatorFault::kProtocolError);
  }
  return transfer;
}

}  // namespace tenter
