// SPDX-License-Identifier: GPL-3.0-or-later
// The table of drivers, and the names of what devices say.
#include <algorithm>
#include <array>

#include "lac_actuator.h"
#include "tenter/rig/actuator_driver.h"
#include "tic_actuator.h"

namespace tenter {
namespace {

template <class Driver>
std::unique_ptr<ActuatorDriver> make(const AxisConfig& config) {
  return std::make_unique<Driver>(config);
}

constexpr std::array kDrivers = {
    ActuatorDriverRow{"tic", tic::kVendor, tic::kProducts, checkTicConfig, make<TicActuator>, true},
    ActuatorDriverRow{"lac", lac::kVendor, lac::kProducts, checkLacConfig, make<LacActuator>,
                      false},
};

constexpr std::array<std::string_view, 6> kStateNames = {
    "reset", "de-energised", "soft-error", "waiting-for-err-line", "starting-up", "normal"};

constexpr std::array<std::string_view, 9> kErrorNames = {
    "de-energised", "driver-error",    "low-supply", "kill-switch", "input-invalid",
    "serial-error", "command-timeout", "safe-start", "err-line"};

}  // namespace

std::span<const ActuatorDriverRow> actuatorDrivers() { return kDrivers; }

const ActuatorDriverRow* findActuatorDriver(std::string_view id) {
  const auto row = std::find_if(kDrivers.begin(), kDrivers.end(),
                                [&](const ActuatorDriverRow& driver) { return driver.id == id; });
  return row == kDrivers.end() ? nullptr : row;
}

std::string_view actuatorStateName(ActuatorState state) {
  return kStateNames.at(static_cast<std::size_t>(state));
}

std::vector<std::string> actuatorErrorNames(std::uint32_t errors) {
  std::vector<std::string> names;
  for (std::size_t bit = 0; bit < 32; ++bit) {
    if ((errors >> bit & 1u) == 0) continue;
    names.push_back(bit < kErrorNames.size() ? std::string(kErrorNames[bit])
                                             : "error-bit-" + std::to_string(bit));
  }
  return names;
}

}  // namespace tenter
