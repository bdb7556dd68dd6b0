// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/virtual_cell.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>

#include "random_numbers.h"

namespace tenter {
namespace {

using Kind = VirtualCellFaultKind;

constexpr std::uint8_t kIllegalFunction = 1, kIllegalAddress = 2, kIllegalValue = 3;
constexpr std::uint32_t kNoNumber_f32 = 0x7FC00000, kNoNumber_i32 = 0x7FFFFFFF;
constexpr std::uint16_t kNoNumber_i16 = 0x7FFF;
constexpr double kOverload = 1.2;         // of the capacity, under an over-range fault
constexpr double kStableWithin_N = 0.02;  // between two conversions
constexpr double kNearZeroWithin_N = 0.05;

int registersOf(const RegisterMap& map) {
  int last = map.status.address;
  for (const RegisterBlock& block : map.blocks) {
    last = std::max(last,
                    block.first + *std::max_element(block.counts.begin(), block.counts.end()) - 1);
  }
  for (const AmplifierCommand& command : map.commands) {
    last = std::max(last, command.address + static_cast<int>(command.words.size()) - 1);
  }
  for (const AmplifierSetting& setting : map.settings) last = std::max(last, setting.bits.address);
  if (map.scale.source) last = std::max(last, map.scale.source->address);
  if (map.unit.source) last = std::max(last, map.unit.source->address);
  return std::min(last + 1, 65536);
}

bool isAt(const VirtualCellFault* fault, Kind kind) {
  return fault != nullptr && fault->kind == kind;
}

}  // namespace

struct VirtualCell::State {
  State(std::uint64_t seed, int register_count)
      : random(seed, "load cell"), registers(static_cast<std::size_t>(register_count)) {}

  RandomNumbers random;
  std::vector<std::uint16_t> registers;
  std::deque<VirtualCellFault> faults;
  std::int64_t conversion = -1;  // number of the last, from the clock
  double raw_N = 0.0, change_N = 0.0;
  double zero_N = 0.0, tare_N = 0.0;
  bool net_mode = false;
  int commands = 0;

  std::uint16_t& at(int address) { return registers[static_cast<std::size_t>(address)]; }
  void setBits(const RegisterBits& bits, unsigned value) {
    const unsigned mask = ((1U << (bits.high_bit - bits.low_bit + 1)) - 1U) << bits.low_bit;
    at(bits.address) =
        static_cast<std::uint16_t>((at(bits.address) & ~mask) | ((value << bits.low_bit) & mask));
  }
};

VirtualCell::VirtualCell(VirtualCellOptions options) : options_(std::move(options)) {
  require(options_.map != nullptr && options_.force_N != nullptr,
          "a virtual cell needs a register map and a force");
  state_ = std::make_unique<State>(options_.seed, registersOf(*options_.map));
  // A choice that the map does not offer becomes its last.
  const auto within = [](unsigned choice, std::size_t size) {
    return std::min(choice, static_cast<unsigned>(size) - 1U);
  };
  const RegisterMap& map = *options_.map;
  if (map.scale.source) {
    options_.scale_choice = within(options_.scale_choice, map.scale.choices.size());
    state_->setBits(*map.scale.source, options_.scale_choice);
  }
  if (map.unit.source) {
    options_.unit_choice = within(options_.unit_choice, map.unit.choices.size());
    state_->setBits(*map.unit.source, options_.unit_choice);
  }
}

VirtualCell::~VirtualCell() = default;

double VirtualCell::newtonsPerCount() const {
  const RegisterMap& map = *options_.map;
  const double scale =
      map.scale.source ? map.scale.choices[options_.scale_choice] : map.scale.constant;
  const std::string& unit =
      map.unit.source ? map.unit.choices[options_.unit_choice] : map.unit.constant;
  return scale * newtonsPerUnit(unit).value_or(1.0);
}

void VirtualCell::convert() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  const double now_s = std::chrono::duration<double>(now).count();
  const bool each = !(options_.conversions_Hz > 0.0);
  const auto number =
      each ? state_->conversion + 1 : static_cast<std::int64_t>(now_s * options_.conversions_Hz);
  if (number == state_->conversion) return;
  const double before_N = state_->raw_N;
  state_->conversion = number;
  state_->raw_N = options_.force_N() + options_.noise_N * state_->random.normal();
  state_->change_N = state_->raw_N - before_N;
}

/// The sign of a magnitude stands in the status.
void VirtualCell::putMagnitudeSign(const WeightField& field, bool negative) {
  const RegisterBits bit{options_.map->status.address, *field.negative_bit, *field.negative_bit};
  state_->setBits(bit, negative ? 1U : 0U);
}

void VirtualCell::putWeight(const WeightField& field, double weight_N,
                            const VirtualCellFault* fault) {
  if (isAt(fault, Kind::kSignFlip)) weight_N = -weight_N;
  const double count = weight_N / newtonsPerCount();
  const bool no_number = isAt(fault, Kind::kNotANumber);
  std::uint32_t bits = 0;
  if (field.type == RegisterType::kF32) {
    bits = no_number ? kNoNumber_f32 : std::bit_cast<std::uint32_t>(static_cast<float>(count));
  } else {
    const bool short_number = registerCount(field.type) == 1;
    const double most = short_number ? kNoNumber_i16 : kNoNumber_i32;
    const double whole = std::clamp(std::round(count), -most, most);
    const double signless = field.negative_bit ? std::abs(whole) : whole;
    if (field.negative_bit) putMagnitudeSign(field, whole < 0.0);
    bits = static_cast<std::uint32_t>(static_cast<std::int64_t>(signless));
    if (no_number) bits = short_number ? kNoNumber_i16 : kNoNumber_i32;
  }
  if (registerCount(field.type) == 1) {
    state_->at(field.address) = static_cast<std::uint16_t>(bits);
    return;
  }
  const auto high = static_cast<std::uint16_t>(bits >> 16);
  const auto low = static_cast<std::uint16_t>(bits);
  const bool high_first = field.high_word_first != isAt(fault, Kind::kWordSwap);
  state_->at(field.address) = high_first ? high : low;
  state_->at(field.address + 1) = high_first ? low : high;
}

void VirtualCell::writeWeights(const VirtualCellFault* fault) {
  const RegisterMap& map = *options_.map;
  // Whole counts first, so that gross = net + tare holds to the last digit.
  const double step_N = map.gross.type == RegisterType::kF32 ? 0.0 : newtonsPerCount();
  const auto rounded = [&](double force_N) {
    return step_N > 0.0 ? step_N * std::round(force_N / step_N) : force_N;
  };
  const double load_N =
      isAt(fault, Kind::kOverRange) ? kOverload * options_.capacity_N : state_->raw_N;
  const double gross_N = rounded(load_N - state_->zero_N);
  const double tare_N = rounded(state_->tare_N);
  putWeight(map.gross, gross_N, fault);
  putWeight(map.net, gross_N - tare_N, fault);
  if (map.tare) putWeight(*map.tare, tare_N, fault);
}

void VirtualCell::writeStatus(const VirtualCellFault* fault) {
  const RegisterMap& map = *options_.map;
  const double gross_N = state_->raw_N - state_->zero_N;
  const bool stable = std::abs(state_->change_N) < kStableWithin_N;
  const bool over = isAt(fault, Kind::kOverRange) || std::abs(state_->raw_N) > options_.capacity_N;
  bool over_reported = false;
  for (int bit = 0; bit < 16; ++bit) {
    bool set = false;
    switch (map.status.bits[static_cast<std::size_t>(bit)]) {
      case StatusMeaning::kNothing:
        continue;
      case StatusMeaning::kCellError:
        set = isAt(fault, Kind::kCellError);
        break;
      case StatusMeaning::kConverterError:
        break;
      case StatusMeaning::kOverRange:  // the first of several
        set = over && !over_reported;
        over_reported = true;
        break;
      case StatusMeaning::kStable:
        set = stable;
        break;
      case StatusMeaning::kUnstable:
        set = !stable;
        break;
      case StatusMeaning::kNearZero:
        set = std::abs(gross_N) < kNearZeroWithin_N;
        break;
      case StatusMeaning::kNetMode:
        set = state_->net_mode;
        break;
    }
    state_->setBits({map.status.address, bit, bit}, set ? 1U : 0U);
  }
}

std::uint8_t VirtualCell::checkRange(int first, int count) const {
  if (count < 1 || count > options_.map->max_registers) return kIllegalValue;
  const auto size = static_cast<int>(state_->registers.size());
  return first < 0 || first + count > size ? kIllegalAddress : 0;
}

std::uint8_t VirtualCell::read(int function, int first, int count,
                               std::vector<std::uint16_t>& words) {
  const std::lock_guard lock(mutex_);
  if (function != options_.map->read_function) return kIllegalFunction;
  if (const std::uint8_t code = checkRange(first, count); code != 0) return code;
  const std::optional<VirtualCellFault> fault = takeFault(false);
  const VirtualCellFault* now = fault ? &*fault : nullptr;
  if (!isAt(now, Kind::kStuck)) {
    convert();
    writeWeights(now);
    writeStatus(now);
  }
  const auto begin = state_->registers.begin() + first;
  words.assign(begin, begin + count);
  return 0;
}

std::uint8_t VirtualCell::write(int function, int first, std::span<const std::uint16_t> words) {
  const std::lock_guard lock(mutex_);
  if (function != options_.map->write_function) return kIllegalFunction;
  if (const auto code = checkRange(first, static_cast<int>(words.size())); code != 0) return code;
  for (const AmplifierCommand& command : options_.map->commands) {
    if (command.address == first &&
        std::equal(command.words.begin(), command.words.end(), words.begin(), words.end())) {
      carryOut(command);
      return 0;
    }
  }
  return kIllegalValue;
}

void VirtualCell::carryOut(const AmplifierCommand& command) {
  convert();
  ++state_->commands;
  if (command.name == "tare") {
    state_->tare_N = state_->raw_N - state_->zero_N;
    state_->net_mode = true;
  } else if (command.name == "zero") {
    state_->zero_N = state_->raw_N;
  } else if (command.name == "gross") {
    state_->tare_N = 0.0;
    state_->net_mode = false;
  }
}

std::optional<VirtualCellFault> VirtualCell::takeFault(bool of_wire) {
  if (state_->faults.empty()) return std::nullopt;
  VirtualCellFault& front = state_->faults.front();
  if (isFaultOfTheWire(front.kind) != of_wire) return std::nullopt;
  const VirtualCellFault fault = front;
  if (front.requests > 0 && --front.requests == 0) state_->faults.pop_front();
  return fault;
}

std::optional<VirtualCellFault> VirtualCell::takeWireFault() {
  const std::lock_guard lock(mutex_);
  return takeFault(true);
}

void VirtualCell::inject(const VirtualCellFault& fault) {
  const std::lock_guard lock(mutex_);
  state_->faults.push_back(fault);
}

void VirtualCell::clear() {
  const std::lock_guard lock(mutex_);
  state_->faults.clear();
}

bool VirtualCell::hasFault() const {
  const std::lock_guard lock(mutex_);
  return !state_->faults.empty();
}

void VirtualCell::chooseScale(unsigned choice) {
  const std::lock_guard lock(mutex_);
  const ScaleRule& scale = options_.map->scale;
  require(scale.source && choice < scale.choices.size(), "the map has no such scale");
  options_.scale_choice = choice;
  state_->setBits(*scale.source, choice);
}

int VirtualCell::commands() const {
  const std::lock_guard lock(mutex_);
  return state_->commands;
}

}  // namespace tenter
