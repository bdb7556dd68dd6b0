// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "tenter/rig/load_cell.h"

struct _modbus;

namespace tenter {

struct ModbusTiming {
  std::int64_t response_timeout_ns = 50'000'000;  ///< The whole answer, and connecting.
  std::int64_t longest_latency_ns = 200'000'000;  ///< RTU: how long an answer may still come.
  std::int64_t first_back_off_ns = 20'000'000;    ///< Doubles with each failure to
  std::int64_t last_back_off_ns = 2'000'000'000;  ///< this, until an answer comes.
};

struct ModbusAnswer {
  LoadCellFault fault = LoadCellFault::kNone;  ///< One of the wire's.
  std::uint8_t exception_code = 0;             ///< Of kException.
  bool late_seen = false;    ///< Bytes of an earlier answer came meanwhile and were dropped.
  std::int64_t sent_ns = 0;  ///< When the request left; 0 if it did not.
};

/// One Modbus connection, TCP or RTU, used by one thread. libmodbus opens and frames; what it lets
/// pass is checked here: unit, transaction, function, count, what lies behind the answer. It closes
/// and reopens by itself with exponential back-off. No call takes longer than twice the response
/// time-out.
///
/// An RTU answer carries no number. So that a late one never counts as the next: after silence the
/// link listens for the device's longest latency before it sends again, and `isSuspect` tells for
/// which lengths an answer may still be under way afterwards.
class ModbusLink {
 public:
  ModbusLink(ModbusAddress address, ModbusTiming timing);
  ~ModbusLink();
  ModbusLink(const ModbusLink&) = delete;
  ModbusLink& operator=(const ModbusLink&) = delete;

  /// Reads words.size() registers (1 to 125) with function 3 or 4; words are written on success
  /// only.
  ModbusAnswer read(int unit, int function, int first, std::span<std::uint16_t> words);
  /// Writes with function 6 (one word) or 16 (1 to 123).
  ModbusAnswer write(int unit, int function, int first, std::span<const std::uint16_t> words);

  /// Whether an answer of that length by that unit may still be on its way.
  bool isSuspect(int unit, int count) const;
  /// Rises with every new connection.
  std::uint64_t generation() const { return generation_; }

 private:
  struct Request;
  struct Suspect {
    int unit, count;
    std::int64_t until_ns;
  };

  ModbusAnswer exchange(const Request& request, std::span<std::uint16_t> words);
  bool connect();
  bool configure();
  void disconnect();
  bool makeReady(ModbusAnswer& answer);
  void listenForLateBytes(std::int64_t until_ns, ModbusAnswer& answer);
  int takeWaitingBytes();
  bool send(const Request& request);
  LoadCellFault receive(const Request& request, std::span<std::uint16_t> words,
                        ModbusAnswer& answer);
  LoadCellFault receiveOnce(const Request& request, std::int64_t deadline_ns,
                            std::span<std::uint16_t> words, ModbusAnswer& answer);
  LoadCellFault faultOfError(int error, const Request& request,
                             std::span<const std::uint8_t> frame) const;
  void settle(const Request& request, const ModbusAnswer& answer);

  ModbusAddress address_;
  ModbusTiming timing_;
  _modbus* context_ = nullptr;
  int descriptor_ = -1;
  std::uint64_t generation_ = 0;
  std::uint16_t transaction_ = 0;
  int silences_ = 0;
  std::int64_t back_off_ns_ = 0, next_connect_ns_ = 0;
  std::int64_t quiet_until_ns_ = 0;  ///< RTU: nothing is sent before.
  std::int64_t next_send_ns_ = 0;    ///< RTU: end of the gap between frames.
  std::vector<Suspect> suspects_;
};

/// The silence that separates two RTU frames: 3.5 characters, 1.75 ms above 19200 baud.
std::int64_t rtuGap_ns(int baud);
/// Time of one character on the wire, with start, parity and stop bits.
std::int64_t rtuCharacter_ns(const ModbusAddress& address);

}  // namespace tenter
