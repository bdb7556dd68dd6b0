// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "load_cell_plausibility.h"
#include "register_map_decode.h"
#include "tenter/rig/load_cell.h"
#include "tenter/rig/modbus_link.h"

namespace tenter {

/// What came of reading one cell once.
struct LoadCellSample {
  LoadCellFault fault = LoadCellFault::kNone;
  std::uint8_t exception_code = 0;
  bool late_seen = false;
  bool stable = false, net_mode = false;
  double gross_N = 0.0, net_N = 0.0;
  std::int64_t stamp_ns = 0;  ///< When the request for the weight left.
};

/// One cell on a link: asks for the map's blocks in turn, keeps the scale up to date, judges.
class LoadCellReader {
 public:
  explicit LoadCellReader(LoadCellConfig config);

  /// One request for each block of the map; or one for a register of the scale, if that is not
  /// known (the fault is then kUnknownScale, or the request's).
  LoadCellSample sample(ModbusLink& link);
  ModbusAnswer command(ModbusLink& link, const AmplifierCommand& command);
  /// The registers of the map's settings.
  ModbusAnswer settings(ModbusLink& link, std::vector<std::uint16_t>& words);

  const LoadCellConfig& config() const { return config_; }

 private:
  ModbusAnswer readBlock(ModbusLink& link, std::size_t block);
  ModbusAnswer askForScale(ModbusLink& link);
  LoadCellFault updateScale();
  void noteFault(LoadCellFault fault);

  LoadCellConfig config_;
  LoadCellPlausibility plausibility_;
  RegisterImage image_;  // what this scan read, and the scale's registers
  std::optional<WeightScale> scale_;
  std::vector<int> to_ask_;  // registers of the scale that are not known on this connection
  std::uint64_t generation_ = 0;
  std::uint64_t turn_ = 0;
};

}  // namespace tenter
