// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/load_cell_scanner.h"

#include <algorithm>
#include <set>

#include "load_cell_bus.h"

namespace tenter {
namespace {

Error badConfig(const LoadCellConfig& cell, const std::string& key, const std::string& reason,
                const std::string& advice = "") {
  return badInput("", "load cell " + cell.id + ": " + key, reason, advice);
}

Result<void> checkConfig(const LoadCellConfig& cell) {
  if (cell.map == nullptr) return badConfig(cell, "map", "is missing");
  if (cell.unit < 1 || cell.unit > 247) return badConfig(cell, "unit", "must be 1 to 247");
  if (!(cell.capacity_N > 0.0 && cell.capacity_N < 1e6)) {
    return badConfig(cell, "capacity_N", "must be positive and below 1e6");
  }
  if (!(cell.lowest_N < cell.capacity_N)) {
    return badConfig(cell, "lowest_N", "must be below the capacity");
  }
  if (cell.stuck_after.count() < 0 || cell.response_timeout.count() < 0 ||
      cell.longest_latency.count() < 0) {
    return badConfig(cell, "times", "must not be negative");
  }
  return {};
}

Result<void> checkTogether(const std::vector<LoadCellConfig>& cells) {
  if (cells.empty()) return badInput("", "load cells", "there are none");
  std::set<std::pair<std::string, int>> places;
  for (const LoadCellConfig& cell : cells) {
    if (const Result<void> good = checkConfig(cell); !good) return good.error();
    if (!places.emplace(cell.address.text(), cell.unit).second) {
      return badConfig(cell, "unit", "another cell has the same address and unit");
    }
    for (const LoadCellConfig& other : cells) {
      const bool one_wire = !cell.address.tcp && cell.address.device == other.address.device;
      if (one_wire && cell.address != other.address) {
        return badConfig(cell, "address", "one serial device with two speeds or formats",
                         "give all cells of a bus the same");
      }
    }
  }
  return {};
}

Error noSuccess(const LoadCellConfig& cell, const ModbusAnswer& answer) {
  std::string reason(loadCellFaultText(answer.fault));
  if (answer.fault == LoadCellFault::kException) {
    reason += " with exception " + std::to_string(answer.exception_code);
  }
  return {ErrorKind::kHardware, "", "load cell " + cell.id, reason, ""};
}

}  // namespace

struct LoadCellScanner::Impl {
  struct Place {
    LoadCellBus* bus;
    std::size_t index;
  };
  std::vector<std::unique_ptr<LoadCellBus>> buses;
  std::vector<Place> places;

  const Place& place(std::size_t cell) const {
    require(cell < places.size(), "there is no load cell " + std::to_string(cell));
    return places[cell];
  }
  const LoadCellConfig& config(std::size_t cell) const {
    return place(cell).bus->config(place(cell).index);
  }

  /// Runs a job between two cells of the bus and waits for it.
  Result<void> ask(std::size_t cell, std::chrono::milliseconds limit, LoadCellBus::Job job) {
    const auto answer = place(cell).bus->run(std::move(job), limit);
    if (!answer) {
      return Error{ErrorKind::kHardware, "", "load cell " + config(cell).id,
                   "the bus was not free in time", ""};
    }
    if (answer->fault != LoadCellFault::kNone) return noSuccess(config(cell), *answer);
    return {};
  }
};

LoadCellScanner::LoadCellScanner(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

LoadCellScanner::~LoadCellScanner() = default;

Result<std::unique_ptr<LoadCellScanner>> LoadCellScanner::start(
    std::vector<LoadCellConfig> cells, const LoadCellScannerOptions& options) {
  if (const Result<void> good = checkTogether(cells); !good) return good.error();
  if (options.tcp_period < std::chrono::microseconds(500)) {
    return badInput("", "tcp_period", "must be at least 0.5 ms");
  }
  auto impl = std::make_unique<Impl>();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    auto bus = std::find_if(impl->buses.begin(), impl->buses.end(), [&](const auto& known) {
      return known->address() == cells[i].address;
    });
    if (bus == impl->buses.end()) {
      impl->buses.push_back(std::make_unique<LoadCellBus>(cells[i].address, options));
      bus = std::prev(impl->buses.end());
    }
    impl->places.push_back({bus->get(), (*bus)->add(cells[i], i)});
  }
  for (const auto& bus : impl->buses) bus->start();
  return std::unique_ptr<LoadCellScanner>(new LoadCellScanner(std::move(impl)));
}

std::size_t LoadCellScanner::cellCount() const { return impl_->places.size(); }

LoadCellReading LoadCellScanner::reading(std::size_t cell) const {
  return impl_->place(cell).bus->reading(impl_->place(cell).index);
}

LoadCellScanStatistics LoadCellScanner::statistics(std::size_t cell) const {
  return impl_->place(cell).bus->statistics();
}

Result<void> LoadCellScanner::command(std::size_t cell, std::string_view name,
                                      std::chrono::milliseconds limit) {
  const LoadCellConfig& config = impl_->config(cell);
  const AmplifierCommand* command = config.map->findCommand(name);
  if (command == nullptr) {
    return badInput("", "load cell " + config.id,
                    config.map->name + " has no command \"" + std::string(name) + "\"");
  }
  const std::size_t index = impl_->place(cell).index;
  return impl_->ask(cell, limit, [=](LoadCellBus& bus) {
    return bus.reader(index).command(bus.link(), *command);
  });
}

Result<std::vector<std::pair<std::string, std::string>>> LoadCellScanner::settings(
    std::size_t cell, std::chrono::milliseconds limit) {
  const auto words = std::make_shared<std::vector<std::uint16_t>>();  // outlives a wait given up
  const std::size_t index = impl_->place(cell).index;
  const Result<void> asked = impl_->ask(cell, limit, [=](LoadCellBus& bus) {
    return bus.reader(index).settings(bus.link(), *words);
  });
  if (!asked) return asked.error();
  std::vector<std::pair<std::string, std::string>> settings;
  const std::vector<AmplifierSetting>& known = impl_->config(cell).map->settings;
  for (std::size_t i = 0; i < known.size(); ++i) {
    const unsigned value = known[i].bits.of((*words)[i]);
    settings.emplace_back(known[i].name, value < known[i].meanings.size() ? known[i].meanings[value]
                                                                          : std::to_string(value));
  }
  return settings;
}

}  // namespace tenter
