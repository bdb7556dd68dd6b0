// SPDX-License-Identifier: GPL-3.0-or-later
#include "live_cells.h"

#include <chrono>
#include <cmath>
#include <iostream>
#include <thread>

#include "interrupt.h"
#include "rig_client.h"

namespace tenter::app {

namespace {

using Json = nlohmann::json;

constexpr auto kPoll = std::chrono::milliseconds(20);
constexpr int kReadings = 50;
constexpr int kPatience = 5;  // polls that may bring nothing new, for each reading

Error noReading(const std::string& cell, const std::string& why) {
  return {ErrorKind::kHardware, "", cell, why, "see `tenter rig status`"};
}

/// What the amplifier said before any calibration in force was put on it.
Result<std::optional<double>> rawReading(const Json& status, const std::string& name) {
  for (const Json& cell : status.value("cells", Json::array())) {
    if (cell.value("name", "") != name) continue;
    const Json gross = cell.value("gross_N", Json());
    if (!gross.is_number()) return std::optional<double>();
    return std::optional<double>(gross.get<double>() / cell.value("gain", 1.0) +
                                 cell.value("offset_N", 0.0));
  }
  return usageError("the rig has no cell \"" + name + "\"");
}

Result<DeadLoad> weigh(RigClient& client, const std::string& cell) {
  double sum = 0.0, squares = 0.0;
  int count = 0;
  std::int64_t last_ns = 0;
  for (int poll = 0; count < kReadings; ++poll) {
    if (poll > kPatience * kReadings) return noReading(cell, "gives no readings");
    std::this_thread::sleep_for(kPoll);
    const auto status = client.call("status");
    if (!status) return status.error();
    const std::int64_t time_ns = status->value("time_ns", std::int64_t{0});
    if (time_ns == last_ns) continue;
    last_ns = time_ns;
    const auto reading_N = rawReading(*status, cell);
    if (!reading_N) return reading_N.error();
    if (!*reading_N) continue;
    sum += **reading_N;
    squares += **reading_N * **reading_N;
    ++count;
  }
  const double mean_N = sum / kReadings;
  const double variance = std::max(0.0, squares / kReadings - mean_N * mean_N);
  return DeadLoad{0.0, mean_N, std::sqrt(variance / (kReadings - 1)), std::nullopt};
}

}  // namespace

Result<std::vector<CellLoads>> weighLive(const LiveWeights& weights, Console& console) {
  const auto client = RigClient::connect(weights.socket);
  if (!client) return client.error();
  std::vector<CellLoads> cells;
  for (const std::string& name : weights.cells) {
    CellLoads cell{name, {}};
    for (const double force_N : weights.forces_N) {
      char text[160];
      std::snprintf(text, sizeof text, "%s: hang on %.4f N, wait until it is still, press Enter",
                    name.c_str(), force_N);
      Console::complain(text);
      std::string line;
      if (interrupted() || !std::getline(std::cin, line)) {
        return usageError("the input ended before all weights had been hung on");
      }
      auto load = weigh(**client, name);
      if (!load) return load.error();
      load->force_N = force_N;
      load->temperature_degC = weights.temperature_degC;
      std::snprintf(text, sizeof text, "  %.4f N +- %.4f N", load->reading_N, load->sigma_N);
      console.warn(text);
      cell.loads.push_back(*load);
    }
    cells.push_back(std::move(cell));
  }
  return cells;
}

}  // namespace tenter::app
