// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tenter/core/result.h"
#include "tenter/rig/register_map.h"

namespace tenter {

/// Why a load cell has no value. Names are those of `loadCellFaultName`.
enum class LoadCellFault : std::uint8_t {
  kNone,
  // the wire
  kNeverRead,
  kDisconnected,
  kDraining,
  kSilence,
  kBrokenAnswer,
  kException,
  kBadCrc,
  kWrongUnit,
  kWrongFunction,
  kWrongCount,
  kWrongFrame,
  kLateAnswer,
  kEcho,
  kTrailingBytes,
  // what the amplifier says
  kCellError,
  kConverterError,
  kOverRange,
  kNotANumber,
  kUnknownScale,
  kScaleChanged,
  // what cannot be true
  kStuck,
  kSignFlip,
  kWordOrder,
  kInconsistent,
  kProbation,
  kStale,
};
inline constexpr int kLoadCellFaultCount = static_cast<int>(LoadCellFault::kStale) + 1;

/// "silence", "bad-crc", ...: for logs and files.
std::string_view loadCellFaultName(LoadCellFault fault);
/// One sentence without a full stop, for people.
std::string_view loadCellFaultText(LoadCellFault fault);

/// Where a Modbus device is to be found.
struct ModbusAddress {
  bool tcp = true;
  std::string host;  ///< TCP: an IPv4 address in digits, so that nothing waits for a name server.
  int port = 502;
  std::string device;  ///< RTU: the serial device.
  int baud = 115200;
  char parity = 'N';
  int stop_bits = 1;

  /// As `parseModbusAddress` reads it.
  std::string text() const;
  bool operator==(const ModbusAddress&) const = default;
};

/// "tcp:192.168.1.10:502" or "rtu:/dev/ttyUSB0:115200:8N1"; port, speed and format may be left out.
Result<ModbusAddress> parseModbusAddress(std::string_view text);

struct LoadCellConfig {
  std::string id;
  ModbusAddress address;
  int unit = 1;  ///< 1 to 247.
  std::shared_ptr<const RegisterMap> map;
  bool reversed = false;              ///< The amplifier's positive is compression.
  double capacity_N = 0.0;            ///< Larger magnitudes are over the range. Must be positive.
  double gain = 1.0, offset_N = 0.0;  ///< force = gain * (what the amplifier says - offset).
  double lowest_N = -1e300;  ///< Tensions below it have the wrong sign; a cord cannot push.
  std::chrono::milliseconds stuck_after{500};     ///< Not one bit moved for so long; 0: off.
  std::chrono::milliseconds response_timeout{0};  ///< 0: the map's.
  std::chrono::milliseconds longest_latency{0};   ///< 0: the map's.
};

/// What is known of a cell at one moment. Times are CLOCK_MONOTONIC.
struct LoadCellReading {
  LoadCellFault fault = LoadCellFault::kNeverRead;  ///< Of the last attempt.
  std::uint8_t exception_code = 0;                  ///< Of kException.
  bool stable = false, net_mode = false;
  double last_gross_N = 0.0, last_net_N = 0.0;  ///< Of the last good sample, however old it is.
  std::int64_t stamp_ns = 0;    ///< When the request of that sample left: never too young.
  std::int64_t attempt_ns = 0;  ///< When the last attempt ended.
  std::int64_t scan_ns = 0;     ///< Length of a scan; a sample older than two is stale.
  std::uint64_t samples = 0, failures = 0, late_answers = 0;

  /// kStale if a good sample has become too old.
  LoadCellFault faultAt(std::int64_t now_ns) const;
  /// Tension against the amplifier's zero, which no tare moves; nothing under any fault.
  std::optional<double> gross_N(std::int64_t now_ns) const;
  /// Tension against the tare; nothing under any fault.
  std::optional<double> net_N(std::int64_t now_ns) const;
};

/// CLOCK_MONOTONIC [ns].
std::int64_t monotonic_ns();

}  // namespace tenter
