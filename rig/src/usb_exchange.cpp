// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/usb_exchange.h"

#include <array>
#include <cstdio>

namespace tenter {
namespace {

constexpr std::uint8_t kVendorOut = 0x40, kVendorIn = 0xC0, kStandardIn = 0x80;
constexpr std::uint8_t kGetDescriptor = 6;
constexpr std::uint16_t kStringDescriptor = 0x0300, kEnglish = 0x0409;
constexpr int kLongestDescriptor = 255;

}  // namespace

UsbRequest UsbRequest::controlOut(std::uint8_t code, std::uint16_t value, std::uint16_t index) {
  UsbRequest request;
  request.type = kVendorOut;
  request.code = code;
  request.value = value;
  request.index = index;
  return request;
}

UsbRequest UsbRequest::controlIn(std::uint8_t code, std::uint16_t index, int length) {
  UsbRequest request;
  request.type = kVendorIn;
  request.code = code;
  request.index = index;
  request.reply_length = length;
  return request;
}

UsbRequest UsbRequest::stringDescriptor(std::uint8_t index) {
  UsbRequest request;
  request.type = kStandardIn;
  request.code = kGetDescriptor;
  request.value = static_cast<std::uint16_t>(kStringDescriptor | index);
  request.index = kEnglish;
  request.reply_length = 2;
  request.max_reply_length = kLongestDescriptor;
  return request;
}

UsbRequest UsbRequest::bulkOut(std::uint8_t endpoint, std::vector<std::uint8_t> bytes) {
  UsbRequest request;
  request.endpoint = endpoint;
  request.out = std::move(bytes);
  return request;
}

UsbRequest UsbRequest::bulkIn(std::uint8_t endpoint, int length) {
  UsbRequest request;
  request.endpoint = endpoint;
  request.reply_length = length;
  return request;
}

UsbRequest UsbRequest::drain(std::uint8_t endpoint, int max_length) {
  UsbRequest request;
  request.endpoint = endpoint;
  request.max_reply_length = max_length;
  request.silence_is_answer = true;
  return request;
}

std::string UsbRequest::name() const {
  std::array<char, 64> text{};
  if (endpoint == 0) {
    std::snprintf(text.data(), text.size(), "request %02X value %u index %u", code, value, index);
  } else if (out.empty()) {
    std::snprintf(text.data(), text.size(), "answer on endpoint %02X", endpoint);
  } else {
    std::snprintf(text.data(), text.size(), "packet %02X on endpoint %02X", out.front(), endpoint);
  }
  return text.data();
}

UsbScript usbSequence(std::vector<UsbRequest> requests) {
  return [requests = std::move(requests), next = std::size_t{0}](const UsbReply*) mutable {
    return next < requests.size() ? UsbStep::send(requests[next++]) : UsbStep::done();
  };
}

UsbScript usbFailure(ActuatorFault fault, std::string detail) {
  return
      [fault, detail = std::move(detail)](const UsbReply*) { return UsbStep::fail(fault, detail); };
}

}  // namespace tenter
