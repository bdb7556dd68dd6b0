// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// What a register map says of one load-cell amplifier; `docs/formats/register-map.md` describes
/// the file. Addresses count from 0, as on the wire.

enum class RegisterType { kU16, kI16, kU32, kI32, kF32 };

/// Registers that a value of the type occupies: 1 or 2.
int registerCount(RegisterType type);

/// A weight in the amplifier's unit after multiplication by the scale.
struct WeightField {
  int address = 0;
  RegisterType type = RegisterType::kI32;
  bool high_word_first = true;      ///< Only of types with two registers.
  std::optional<int> negative_bit;  ///< The number is a magnitude, its sign this bit of the status.
  bool twos_complement = false;     ///< A magnitude with its top bit set is taken as negative too.
};

/// Some bits of one register, bit 0 the lowest.
struct RegisterBits {
  int address = 0;
  int low_bit = 0, high_bit = 15;

  unsigned of(std::uint16_t word) const;
};

/// A constant, or what the bits of a register choose from a list.
struct ScaleRule {
  double constant = 1.0;
  std::optional<RegisterBits> source;
  std::vector<double> choices;  ///< By the bits' value; with a source only.
};
struct UnitRule {
  std::string constant;
  std::optional<RegisterBits> source;
  std::vector<std::string> choices;  ///< An empty one is a unit that is no force.
};

/// A run of registers that is read in every scan, in the counts given, one after the other: answers
/// of neighbouring requests then differ in length, and a late one is recognised.
struct RegisterBlock {
  int first = 0;
  std::vector<int> counts;
};

/// What a status bit says when it is set.
enum class StatusMeaning {
  kNothing,
  kCellError,
  kConverterError,
  kOverRange,
  kStable,
  kUnstable,
  kNearZero,
  kNetMode,
};

struct StatusRegister {
  int address = 0;
  std::vector<StatusMeaning> bits = std::vector<StatusMeaning>(16);
};

struct AmplifierCommand {
  std::string name;  ///< "tare", "zero", or what else the file offers.
  int address = 0;
  std::vector<std::uint16_t> words;
};

/// A number that somebody set on the amplifier, shown and recorded but never written.
struct AmplifierSetting {
  std::string name;
  RegisterBits bits;
  std::vector<std::string> meanings;  ///< By the bits' value; may be empty.
};

struct RegisterMap {
  std::string name;
  int read_function = 3;    ///< 3 or 4.
  int write_function = 16;  ///< 6 or 16.
  int max_registers = 125;  ///< Of one request.
  int turnaround_ms = 5;    ///< Usual time from the request's end to the answer's begin.
  int response_timeout_ms = 50;
  int longest_latency_ms = 200;  ///< No answer comes later than this.
  std::vector<RegisterBlock> blocks;
  StatusRegister status;
  WeightField gross, net;
  std::optional<WeightField> tare;
  double sum_tolerance = 0.0;  ///< Of gross = net + tare, in the amplifier's unit.
  ScaleRule scale;
  UnitRule unit;
  std::vector<AmplifierCommand> commands;
  std::vector<AmplifierSetting> settings;

  /// Nothing if the amplifier has no such command.
  const AmplifierCommand* findCommand(std::string_view command) const;
  /// Registers that the scale and the unit come from and that not every scan reads.
  std::vector<int> scaleRegistersToAsk() const;
  /// How many registers block `block` reads in turn `turn`.
  int countInTurn(int block, std::uint64_t turn) const;
};

/// The error names the file, the key and the reason.
Result<RegisterMap> readRegisterMap(const std::filesystem::path& file);
Result<RegisterMap> parseRegisterMap(std::string_view toml, const std::string& file);

/// Newtons of one N, mN, kN, g, kg, t or lb (weights under standard gravity); nothing for others.
std::optional<double> newtonsPerUnit(std::string_view unit);

}  // namespace tenter
