// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "load_cell_reader.h"
#include "load_cell_snapshot.h"
#include "tenter/rig/load_cell_scanner.h"
#include "tenter/rig/modbus_link.h"

namespace tenter {

/// One connection, the cells on it and the thread that reads them.
class LoadCellBus {
 public:
  /// Something else to do on the bus, on its thread.
  using Job = std::function<ModbusAnswer(LoadCellBus&)>;

  LoadCellBus(ModbusAddress address, const LoadCellScannerOptions& options);
  ~LoadCellBus();

  /// Before start(). `number` is the cell's among all, for events. Returns its index here.
  std::size_t add(const LoadCellConfig& config, std::size_t number);
  void start();

  const ModbusAddress& address() const { return address_; }
  const LoadCellConfig& config(std::size_t index) const { return cells_[index]->reader.config(); }
  LoadCellReading reading(std::size_t index) const { return cells_[index]->snapshot.load(); }
  LoadCellScanStatistics statistics() const { return statistics_.load(); }

  /// Nothing if the job was not done within the limit; it is then not begun any more.
  std::optional<ModbusAnswer> run(Job job, std::chrono::milliseconds limit);

  /// For jobs.
  ModbusLink& link() { return *link_; }
  LoadCellReader& reader(std::size_t index) { return cells_[index]->reader; }

 private:
  struct Cell {
    Cell(const LoadCellConfig& config, std::size_t number_of_cell)
        : reader(config), number(number_of_cell) {}
    LoadCellReader reader;
    std::size_t number;
    LoadCellReading last;
    Snapshot<LoadCellReading> snapshot{LoadCellReading{}};
  };
  struct Order {
    Job job;
    std::optional<ModbusAnswer> answer;
    bool begun = false, given_up = false;
  };

  void loop();
  void scanCell(Cell& cell);
  void doOrders();
  void noteScan(std::int64_t begin_ns);
  std::int64_t plannedScan_ns() const;

  ModbusAddress address_;
  LoadCellScannerOptions options_;
  std::vector<std::unique_ptr<Cell>> cells_;
  std::unique_ptr<ModbusLink> link_;
  std::int64_t planned_ns_ = 0;
  LoadCellScanStatistics totals_;
  Snapshot<LoadCellScanStatistics> statistics_{LoadCellScanStatistics{}};

  std::atomic<bool> stop_{false};
  std::mutex mutex_;  // of the orders
  std::condition_variable changed_;
  std::vector<std::shared_ptr<Order>> orders_;
  std::atomic<bool> has_orders_{false};
  std::thread thread_;
};

}  // namespace tenter
