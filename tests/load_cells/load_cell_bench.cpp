// SPDX-License-Identifier: GPL-3.0-or-later
#include "load_cell_bench.h"

#include <stdexcept>
#include <thread>

#include "tenter/test_support/data.h"

namespace tenter::load_cell_tests {

std::shared_ptr<const RegisterMap> shippedMap(const std::string& name) {
  const auto file = test_support::sourceFolder() / "rig/register-maps" / (name + ".toml");
  return std::make_shared<const RegisterMap>(readRegisterMap(file).value());
}

Bench::Bench(const BenchOptions& options) : options_(options), map_(shippedMap(options.map)) {
  VirtualUnits bus;
  for (int i = 0; i < options.cells; ++i) {
    const auto force_N = std::make_shared<std::atomic<double>>(0.0);
    VirtualCellOptions cell;
    cell.map = map_;
    cell.force_N = [force_N] { return force_N->load(); };
    if (options.force) cell.force_N = options.force;
    cell.noise_N = options.noise_N;
    cell.capacity_N = options.capacity_N;
    cell.seed = options.seed + static_cast<std::uint64_t>(i);
    cell.scale_choice = map_->name == "Laumas TLB" ? 15 : 4;
    forces_N_.push_back(force_N);
    cells_.push_back(std::make_shared<VirtualCell>(cell));
    bus[i + 1] = cells_.back();
    if (options.wire == Wire::kTcp) {
      servers_.push_back(VirtualModbus::serveTcp({{i + 1, cells_.back()}}).value());
    }
  }
  if (options.wire == Wire::kTcp) return;
  VirtualRtuOptions rtu;
  rtu.link = folder_ / "bus";
  rtu.turnaround = options.rtu_turnaround;
  rtu.paced = options.paced;
  servers_.push_back(VirtualModbus::serveRtu(bus, rtu).value());
}

std::vector<LoadCellConfig> Bench::configs() const {
  std::vector<LoadCellConfig> configs;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    LoadCellConfig config;
    config.id = "cell " + std::to_string(i);
    const auto& server = servers_[servers_.size() == 1 ? 0 : i];
    config.address = parseModbusAddress(server->address()).value();
    config.unit = static_cast<int>(i) + 1;
    config.map = map_;
    config.capacity_N = options_.capacity_N;
    config.lowest_N = -0.5;
    config.stuck_after = options_.stuck_after;
    config.response_timeout = options_.response_timeout;
    config.longest_latency = options_.longest_latency;
    configs.push_back(config);
  }
  return configs;
}

std::unique_ptr<LoadCellScanner> Bench::startScanner(const LoadCellScannerOptions& options) const {
  return LoadCellScanner::start(configs(), options).value();
}

bool waitFor(const std::function<bool()>& condition, std::chrono::milliseconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace tenter::load_cell_tests
