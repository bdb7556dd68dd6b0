// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tenter/rig/load_cell_scanner.h"
#include "tenter/test_support/temporary_folder.h"
#include "tenter/twin/virtual_modbus.h"

namespace tenter::load_cell_tests {

/// One of the maps that ship with `rig`, by file name without extension. Throws if it is broken.
std::shared_ptr<const RegisterMap> shippedMap(const std::string& name);

enum class Wire { kTcp, kRtu };

struct BenchOptions {
  std::string map = "laumas-tlb";
  Wire wire = Wire::kTcp;
  int cells = 1;
  bool paced = true;
  std::chrono::microseconds rtu_turnaround{3000};
  std::chrono::milliseconds response_timeout{0}, longest_latency{0};  ///< 0: the map's.
  std::chrono::milliseconds stuck_after{0};
  double noise_N = 0.003;
  double capacity_N = 50.0;
  std::uint64_t seed = 1;
  std::function<double()> force = nullptr;  ///< [N], of all cells; without, what setForce() says.
};

/// Virtual cells with a force that tests set, on TCP (a server each) or on one RTU bus. The
/// destructor ends the servers.
class Bench {
 public:
  explicit Bench(const BenchOptions& options);

  VirtualCell& cell(int index) { return *cells_[static_cast<std::size_t>(index)]; }
  void setForce(int index, double force_N) {
    *forces_N_[static_cast<std::size_t>(index)] = force_N;
  }
  double force_N(int index) const { return *forces_N_[static_cast<std::size_t>(index)]; }
  VirtualModbus& server(int index) { return *servers_[servers_.size() == 1 ? 0 : index]; }
  std::vector<LoadCellConfig> configs() const;
  std::unique_ptr<LoadCellScanner> startScanner(const LoadCellScannerOptions& options = {}) const;

 private:
  BenchOptions options_;
  test_support::TemporaryFolder folder_;
  std::shared_ptr<const RegisterMap> map_;
  std::vector<std::shared_ptr<std::atomic<double>>> forces_N_;
  std::vector<std::shared_ptr<VirtualCell>> cells_;
  std::vector<std::unique_ptr<VirtualModbus>> servers_;
};

/// Polls until the condition holds; false after the limit.
bool waitFor(const std::function<bool()>& condition,
             std::chrono::milliseconds limit = std::chrono::milliseconds(3000));

}  // namespace tenter::load_cell_tests
