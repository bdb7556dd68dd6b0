// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "tenter/rig/actuator_driver.h"

namespace tenter {
namespace {

constexpr double kLongestTravel_m = 10.0;  // catches millimetres given as metres
constexpr double kFastest_m_per_s = 1.0;   // no axis here is meant to be quick
constexpr double kSteepest_m_per_s2 = 100.0;
constexpr std::chrono::milliseconds kLongestTimeout{1000};
constexpr std::chrono::milliseconds kShortestTimeout{20};

Error wrong(const AxisConfig& config, const std::string& field, std::string reason,
            std::string advice = "") {
  return badInput("", "axis " + config.name + ": " + field, std::move(reason), std::move(advice));
}

bool within(double value, double min, double max) { return value >= min && value <= max; }

}  // namespace

Result<void> checkAxisConfig(const AxisConfig& config) {
  if (config.name.empty()) return badInput("", "axis: name", "an axis needs a name");
  const ActuatorDriverRow* row = findActuatorDriver(config.driver);
  if (row == nullptr) {
    std::string known;
    for (const ActuatorDriverRow& driver : actuatorDrivers()) {
      known += (known.empty() ? "" : ", ") + std::string(driver.id);
    }
    return wrong(config, "driver", "there is no driver \"" + config.driver + "\"",
                 "drivers are: " + known);
  }
  if (config.serial.empty() && config.port.empty()) {
    return wrong(config, "serial", "neither a serial number nor a port tells which device it is");
  }
  const double scale = std::abs(config.metres_per_unit);
  if (!(scale > 0.0 && scale < kLongestTravel_m)) {
    return wrong(config, "metres_per_unit", "it must be a number other than zero");
  }
  if (!within(config.origin_m, -kLongestTravel_m, kLongestTravel_m)) {
    return wrong(config, "origin_m", "it must be within 10 m of zero");
  }
  if (!within(config.travel_min_m, -kLongestTravel_m, kLongestTravel_m) ||
      !within(config.travel_max_m, -kLongestTravel_m, kLongestTravel_m) ||
      config.travel_min_m >= config.travel_max_m) {
    return wrong(config, "travel", "its minimum must lie below its maximum, within 10 m of zero");
  }
  if (!(config.max_speed_m_per_s > 0.0 && config.max_speed_m_per_s <= kFastest_m_per_s)) {
    return wrong(config, "max_speed_m_per_s", "it must be above 0 and at most 1 m/s");
  }
  if (config.command_timeout < kShortestTimeout || config.command_timeout > kLongestTimeout) {
    return wrong(config, "command_timeout", "it must be 20 to 1000 ms");
  }
  if (!within(config.max_acceleration_m_per_s2, 0.0, kSteepest_m_per_s2)) {
    return wrong(config, "max_acceleration_m_per_s2", "it must be 0 to 100 m/s^2");
  }
  return row->check(config);
}

}  // namespace tenter
