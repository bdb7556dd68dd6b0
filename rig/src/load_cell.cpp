// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/load_cell.h"

#include <arpa/inet.h>

#include <array>
#include <charconv>
#include <vector>

namespace tenter {
namespace {

struct FaultWords {
  std::string_view name, text;
};

/// In the order of LoadCellFault.
constexpr std::array<FaultWords, kLoadCellFaultCount> kFaults{{
    {"none", "the cell answers"},
    {"never-read", "the cell has not been read yet"},
    {"disconnected", "the connection is closed"},
    {"draining", "the bus is kept silent until no earlier answer can come any more"},
    {"silence", "the amplifier did not answer"},
    {"broken-answer", "the answer broke off or came too slowly"},
    {"exception", "the amplifier refused the request"},
    {"bad-crc", "the answer was garbled: its checksum is wrong"},
    {"wrong-unit", "another unit answered"},
    {"wrong-function", "the answer is to another kind of request"},
    {"wrong-count", "the answer has another length than was asked for"},
    {"wrong-frame", "the answer's frame is not one of Modbus"},
    {"late-answer", "the answer to an earlier request came too late"},
    {"echo", "the request came back: the RS-485 adapter hears itself"},
    {"trailing-bytes", "bytes follow the answer that belong to nothing"},
    {"cell-error", "the amplifier reports an error of the cell or its cable"},
    {"converter-error", "the amplifier reports an error of its converter"},
    {"over-range", "the load is beyond the cell's range"},
    {"not-a-number", "the amplifier sent a number that is none"},
    {"unknown-scale", "the amplifier's division or unit is not one of force"},
    {"scale-changed", "somebody changed the amplifier's division or unit"},
    {"stuck", "the value has not moved by a single bit for too long"},
    {"sign-flip", "the value has the wrong sign"},
    {"word-order", "the halves of the value are swapped, or it is too small to be a weight"},
    {"inconsistent", "gross, net and tare do not agree"},
    {"probation", "readings are good again but not trusted yet"},
    {"stale", "the last good reading is too old"},
}};

const FaultWords& wordsOf(LoadCellFault fault) { return kFaults[static_cast<std::size_t>(fault)]; }

constexpr std::string_view kAddressAdvice =
    "such as tcp:192.168.1.10:502 or rtu:/dev/ttyUSB0:115200:8N1";

Error badAddress(std::string_view text, const std::string& reason) {
  return badInput("", std::string(text), reason, std::string(kAddressAdvice));
}

std::vector<std::string> splitAtColons(std::string_view text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ':') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

std::optional<int> wholeNumber(const std::string& text, int min, int max) {
  int number = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stop != end || number < min || number > max) return std::nullopt;
  return number;
}

Result<ModbusAddress> parseTcp(std::string_view text, const std::vector<std::string>& parts) {
  ModbusAddress address;
  address.host = parts[1];
  in_addr ignored{};
  if (inet_pton(AF_INET, address.host.c_str(), &ignored) != 1) {
    return badAddress(text, "the host must be an IPv4 address in digits");
  }
  if (parts.size() > 3) return badAddress(text, "has too many parts");
  if (parts.size() == 3) {
    const auto port = wholeNumber(parts[2], 1, 65535);
    if (!port) return badAddress(text, "the port must be 1 to 65535");
    address.port = *port;
  }
  return address;
}

Result<ModbusAddress> parseRtu(std::string_view text, const std::vector<std::string>& parts) {
  ModbusAddress address;
  address.tcp = false;
  address.device = parts[1];
  if (address.device.empty() || address.device[0] != '/') {
    return badAddress(text, "the serial device must be an absolute path");
  }
  if (parts.size() > 4) return badAddress(text, "has too many parts");
  if (parts.size() >= 3) {
    const auto baud = wholeNumber(parts[2], 1200, 921600);
    if (!baud) return badAddress(text, "the speed must be 1200 to 921600 baud");
    address.baud = *baud;
  }
  if (parts.size() == 4) {
    const std::string& format = parts[3];
    const bool good = format.size() == 3 && format[0] == '8' &&
                      std::string_view("NEO").find(format[1]) != std::string_view::npos &&
                      (format[2] == '1' || format[2] == '2');
    if (!good) return badAddress(text, "the format must be 8N1, 8N2, 8E1, 8E2, 8O1 or 8O2");
    address.parity = format[1];
    address.stop_bits = format[2] - '0';
  }
  return address;
}

}  // namespace

std::string_view loadCellFaultName(LoadCellFault fault) { return wordsOf(fault).name; }

std::string_view loadCellFaultText(LoadCellFault fault) { return wordsOf(fault).text; }

std::string ModbusAddress::text() const {
  if (tcp) return "tcp:" + host + ":" + std::to_string(port);
  return "rtu:" + device + ":" + std::to_string(baud) + ":8" + parity + std::to_string(stop_bits);
}

Result<ModbusAddress> parseModbusAddress(std::string_view text) {
  const std::vector<std::string> parts = splitAtColons(text);
  if (parts.size() >= 2 && parts[0] == "tcp") return parseTcp(text, parts);
  if (parts.size() >= 2 && parts[0] == "rtu") return parseRtu(text, parts);
  return badAddress(text, "must begin with tcp: or rtu:");
}

LoadCellFault LoadCellReading::faultAt(std::int64_t now_ns) const {
  if (fault != LoadCellFault::kNone) return fault;
  return now_ns - stamp_ns > 2 * scan_ns ? LoadCellFault::kStale : LoadCellFault::kNone;
}

std::optional<double> LoadCellReading::gross_N(std::int64_t now_ns) const {
  if (faultAt(now_ns) != LoadCellFault::kNone) return std::nullopt;
  return last_gross_N;
}

std::optional<double> LoadCellReading::net_N(std::int64_t now_ns) const {
  if (faultAt(now_ns) != LoadCellFault::kNone) return std::nullopt;
  return last_net_N;
}

std::int64_t monotonic_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace tenter
