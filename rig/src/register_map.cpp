// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/register_map.h"

#include <algorithm>
#include <array>
#include <utility>

#include "tenter/core/types.h"

namespace tenter {

int registerCount(RegisterType type) {
  return type == RegisterType::kU16 || type == RegisterType::kI16 ? 1 : 2;
}

unsigned RegisterBits::of(std::uint16_t word) const {
  const unsigned mask = (1U << (high_bit - low_bit + 1)) - 1U;
  return (static_cast<unsigned>(word) >> low_bit) & mask;
}

const AmplifierCommand* RegisterMap::findCommand(std::string_view command) const {
  const auto found = std::find_if(commands.begin(), commands.end(),
                                  [&](const auto& entry) { return entry.name == command; });
  return found == commands.end() ? nullptr : &*found;
}

std::vector<int> RegisterMap::scaleRegistersToAsk() const {
  std::vector<int> wanted;
  for (const std::optional<RegisterBits>& source : {scale.source, unit.source}) {
    if (!source) continue;
    const bool in_every_scan =
        std::any_of(blocks.begin(), blocks.end(), [&](const RegisterBlock& block) {
          const int shortest = *std::min_element(block.counts.begin(), block.counts.end());
          return source->address >= block.first && source->address < block.first + shortest;
        });
    const bool known = std::find(wanted.begin(), wanted.end(), source->address) != wanted.end();
    if (!in_every_scan && !known) wanted.push_back(source->address);
  }
  return wanted;
}

int RegisterMap::countInTurn(int block, std::uint64_t turn) const {
  const std::vector<int>& counts = blocks[static_cast<std::size_t>(block)].counts;
  return counts[turn % counts.size()];
}

std::optional<double> newtonsPerUnit(std::string_view unit) {
  constexpr double kPound_kg = 0.45359237;
  constexpr double kG = kStandardGravity_m_per_s2;
  constexpr std::array<std::pair<std::string_view, double>, 7> kUnits{{{"N", 1.0},
                                                                       {"mN", 1e-3},
                                                                       {"kN", 1e3},
                                                                       {"g", 1e-3 * kG},
                                                                       {"kg", kG},
                                                                       {"t", 1e3 * kG},
                                                                       {"lb", kPound_kg * kG}}};
  for (const auto& [name, newtons] : kUnits) {
    if (name == unit) return newtons;
  }
  return std::nullopt;
}

}  // namespace tenter
