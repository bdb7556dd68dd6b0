// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/rig/load_cell.h"

namespace tenter {

/// A cell fell into another fault, recovered (kNone), or an answer came late.
struct LoadCellEvent {
  std::size_t cell = 0;
  LoadCellFault fault = LoadCellFault::kNone;
  std::uint8_t exception_code = 0;
  std::int64_t time_ns = 0;
};

struct LoadCellScannerOptions {
  /// A scan of a TCP connection begins so often; 5 ms are 200 Hz. An RTU bus is read as fast as its
  /// speed and gaps allow.
  std::chrono::microseconds tcp_period{5000};
  /// Called from the reading threads; must be quick and safe to call from several.
  std::function<void(const LoadCellEvent&)> on_event;
  /// Called likewise with each reading, once reading() gives it.
  std::function<void(const LoadCellReading&)> on_reading;
};

/// How the scans of the bus that a cell hangs on went so far.
struct LoadCellScanStatistics {
  std::uint64_t scans = 0;
  std::int64_t last_ns = 0, longest_ns = 0, mean_ns = 0;
};

/// Reads all load cells without pause, one thread a bus (a serial device, or a TCP address and
/// port), so that a silent amplifier delays only those that share its bus.
class LoadCellScanner {
 public:
  /// Checks the configuration and starts the threads; whether the cells answer shows in their
  /// readings.
  static Result<std::unique_ptr<LoadCellScanner>> start(std::vector<LoadCellConfig> cells,
                                                        const LoadCellScannerOptions& options = {});
  ~LoadCellScanner();
  LoadCellScanner(const LoadCellScanner&) = delete;
  LoadCellScanner& operator=(const LoadCellScanner&) = delete;

  std::size_t cellCount() const;
  /// Lock-free and without allocation, from any thread.
  LoadCellReading reading(std::size_t cell) const;
  LoadCellScanStatistics statistics(std::size_t cell) const;

  /// Sends one of the map's commands ("tare", "zero") and waits for the amplifier's confirmation,
  /// at most `limit`; what was not sent by then is not sent later.
  Result<void> command(std::size_t cell, std::string_view name,
                       std::chrono::milliseconds limit = std::chrono::milliseconds(500));
  /// The map's settings as the amplifier has them: name, and meaning or number.
  Result<std::vector<std::pair<std::string, std::string>>> settings(
      std::size_t cell, std::chrono::milliseconds limit = std::chrono::milliseconds(500));

 private:
  struct Impl;
  explicit LoadCellScanner(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tenter
