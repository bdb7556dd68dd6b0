// SPDX-License-Identifier: GPL-3.0-or-later
#include "load_cell_reader.h"

#include <algorithm>
#include <array>

namespace tenter {
namespace {

/// Faults after which the amplifier may be another one, or have other settings.
bool mayHaveRestarted(LoadCellFault fault) {
  return fault == LoadCellFault::kSilence || fault == LoadCellFault::kDisconnected ||
         fault == LoadCellFault::kBrokenAnswer;
}

}  // namespace

LoadCellReader::LoadCellReader(LoadCellConfig config)
    : config_(std::move(config)), plausibility_(config_) {
  to_ask_ = config_.map->scaleRegistersToAsk();
}

void LoadCellReader::noteFault(LoadCellFault fault) {
  if (mayHaveRestarted(fault)) to_ask_ = config_.map->scaleRegistersToAsk();
}

ModbusAnswer LoadCellReader::readBlock(ModbusLink& link, std::size_t block) {
  const RegisterBlock& registers = config_.map->blocks[block];
  ModbusAnswer answer;
  for (std::size_t i = 0; i < registers.counts.size(); ++i) {
    const int count = config_.map->countInTurn(static_cast<int>(block), turn_ + i);
    if (link.isSuspect(config_.unit, count)) continue;
    std::array<std::uint16_t, 125> words;
    const std::span<std::uint16_t> place(words.data(), static_cast<std::size_t>(count));
    answer = link.read(config_.unit, config_.map->read_function, registers.first, place);
    if (answer.fault == LoadCellFault::kNone) image_.put(registers.first, place);
    return answer;
  }
  answer.fault = LoadCellFault::kDraining;  // an answer of any length might be an old one
  return answer;
}

ModbusAnswer LoadCellReader::askForScale(ModbusLink& link) {
  ModbusAnswer answer;
  answer.fault = LoadCellFault::kDraining;
  if (link.isSuspect(config_.unit, 1)) return answer;
  std::array<std::uint16_t, 1> word{};
  answer = link.read(config_.unit, config_.map->read_function, to_ask_.back(), word);
  if (answer.fault != LoadCellFault::kNone) return answer;
  image_.put(to_ask_.back(), word);
  to_ask_.pop_back();
  answer.fault = LoadCellFault::kUnknownScale;
  return answer;
}

LoadCellFault LoadCellReader::updateScale() {
  const std::optional<WeightScale> now = scaleOf(*config_.map, image_);
  if (!now) return LoadCellFault::kUnknownScale;
  const bool changed = scale_ && *scale_ != *now;
  scale_ = now;
  return changed ? LoadCellFault::kScaleChanged : LoadCellFault::kNone;
}

LoadCellSample LoadCellReader::sample(ModbusLink& link) {
  if (generation_ != link.generation()) {
    generation_ = link.generation();
    to_ask_ = config_.map->scaleRegistersToAsk();
  }
  LoadCellSample sample;
  const auto take = [&](const ModbusAnswer& answer) {
    sample.fault = answer.fault;
    sample.exception_code = answer.exception_code;
    sample.late_seen = sample.late_seen || answer.late_seen;
    if (sample.stamp_ns == 0) sample.stamp_ns = answer.sent_ns;
    noteFault(answer.fault);
    return answer.fault == LoadCellFault::kNone;
  };
  if (!to_ask_.empty()) {
    take(askForScale(link));
    return sample;
  }
  ++turn_;
  for (std::size_t block = 0; block < config_.map->blocks.size(); ++block) {
    if (!take(readBlock(link, block))) return sample;
  }
  const LoadCellFault scale_fault = updateScale();
  if (!scale_) {
    sample.fault = scale_fault;
    return sample;
  }
  DecodedWeights weights = decodeWeights(*config_.map, image_, *scale_);
  if (scale_fault != LoadCellFault::kNone) weights.fault = scale_fault;
  sample.fault = plausibility_.judge(weights, sample.stamp_ns);
  const double direction = config_.reversed ? -1.0 : 1.0;
  sample.gross_N = config_.gain * (direction * weights.gross_N - config_.offset_N);
  sample.net_N = config_.gain * direction * weights.net_N;
  sample.stable = weights.stable;
  sample.net_mode = weights.net_mode;
  return sample;
}

ModbusAnswer LoadCellReader::command(ModbusLink& link, const AmplifierCommand& command) {
  const int function = config_.map->write_function;
  const ModbusAnswer answer = link.write(config_.unit, function, command.address, command.words);
  noteFault(answer.fault);
  if (answer.fault != LoadCellFault::kNone || function != 6) return answer;
  // Function 6 is confirmed by its own request: an echo looks the same. Only a read tells them
  // apart.
  ++turn_;
  return readBlock(link, 0);
}

ModbusAnswer LoadCellReader::settings(ModbusLink& link, std::vector<std::uint16_t>& words) {
  ModbusAnswer answer;
  for (const AmplifierSetting& setting : config_.map->settings) {
    std::array<std::uint16_t, 1> word{};
    answer = link.read(config_.unit, config_.map->read_function, setting.bits.address, word);
    noteFault(answer.fault);
    if (answer.fault != LoadCellFault::kNone) return answer;
    words.push_back(word[0]);
  }
  return answer;
}

}  // namespace tenter
