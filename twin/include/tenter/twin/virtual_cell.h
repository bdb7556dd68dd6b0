// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/rig/register_map.h"

namespace tenter {

class RandomNumbers;

enum class VirtualCellFaultKind {
  // of the wire
  kSilence,
  kException,
  kBadCrc,
  kHalfFrame,
  kDribble,
  kLateAnswer,
  kEcho,
  kWrongUnit,
  kWrongFunction,
  kWrongCount,
  kTrailingBytes,
  kHangUp,
  // of the value
  kStuck,
  kNotANumber,
  kOverRange,
  kSignFlip,
  kWordSwap,
  kCellError,
};

struct VirtualCellFault {
  VirtualCellFaultKind kind = VirtualCellFaultKind::kSilence;
  int exception_code = 0;             ///< Of kException.
  std::chrono::microseconds delay{};  ///< Of a late answer, or between the bytes of a dribble.
  int requests = 1;                   ///< How many in a row it befalls; 0: until clear().
};

/// "silence", "exception-6", "late-answer", ...; the error lists the names.
Result<VirtualCellFault> parseVirtualCellFault(std::string_view name);
std::string virtualCellFaultName(const VirtualCellFault& fault);
/// All names, exceptions 1 to 6 and 11 among them.
std::vector<std::string> virtualCellFaultNames();
bool isFaultOfTheWire(VirtualCellFaultKind kind);
/// Modbus TCP has no checksum and no echo.
bool canBefall(VirtualCellFaultKind kind, bool tcp);

struct VirtualCellOptions {
  std::shared_ptr<const RegisterMap> map;
  std::function<double()> force_N;  ///< Tension now; called from the serving thread.
  double noise_N = 0.003;           ///< Standard deviation of a conversion.
  std::uint64_t seed = 1;
  double capacity_N = 100.0;      ///< Beyond it the amplifier reports over-range.
  double conversions_Hz = 300.0;  ///< Between two conversions the value stands; 0: one a request.
  unsigned scale_choice = 15;     ///< What the scale's register holds, if the map has one, and
  unsigned unit_choice = 4;       ///< the unit's: 0.001 and N of a Laumas TLB.
};

/// The registers of one amplifier and what they do: conversions with noise, tare, zero, faults of
/// the value. Safe to use from several threads.
class VirtualCell {
 public:
  explicit VirtualCell(VirtualCellOptions options);
  ~VirtualCell();

  /// Exception code, 0 if the words are there.
  std::uint8_t read(int function, int first, int count, std::vector<std::uint16_t>& words);
  std::uint8_t write(int function, int first, std::span<const std::uint16_t> words);

  /// Queues behind the faults that are not used up.
  void inject(const VirtualCellFault& fault);
  void clear();
  bool hasFault() const;
  /// For the wire that serves the cell: the fault that befalls this request.
  std::optional<VirtualCellFault> takeWireFault();

  /// As somebody does at the amplifier's keys. Precondition: the map lets a register choose.
  void chooseScale(unsigned choice);
  /// Commands carried out since the beginning.
  int commands() const;

 private:
  struct State;
  std::uint8_t checkRange(int first, int count) const;
  void convert();
  void writeWeights(const VirtualCellFault* fault);
  void writeStatus(const VirtualCellFault* fault);
  void putWeight(const WeightField& field, double weight_N, const VirtualCellFault* fault);
  void putMagnitudeSign(const WeightField& field, bool negative);
  double newtonsPerCount() const;
  std::optional<VirtualCellFault> takeFault(bool of_wire);
  void carryOut(const AmplifierCommand& command);

  VirtualCellOptions options_;
  mutable std::mutex mutex_;
  std::unique_ptr<State> state_;
};

}  // namespace tenter
