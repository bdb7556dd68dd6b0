// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/twin/virtual_cell.h"
#include "tenter/twin/virtual_usb.h"

namespace tenter {

/// What a rig is doing, as its devices show it: nobody tells them.
enum class RigPhase {
  kIdle,       ///< Nothing moves, no cord pulls.
  kHoming,     ///< Any axis looks for its end.
  kJog,        ///< One axis moves.
  kLoading,    ///< Several axes move and draw cords in.
  kHolding,    ///< Nothing moves, a cord pulls.
  kUnloading,  ///< Several axes move and let cords out.
};
std::string_view rigPhaseName(RigPhase phase);
std::optional<RigPhase> findRigPhase(std::string_view name);

/// When a fault of a script begins. Exactly one of the first five is there.
struct FaultTrigger {
  std::optional<double> at_s;        ///< Since the rig is served.
  std::optional<RigPhase> phase;     ///< When that phase begins.
  std::optional<double> force_N;     ///< When the device's cord pulls so much.
  std::optional<double> position_m;  ///< When the device's axis has passed there, drawing in.
  std::string after;                 ///< When the fault of that name has ended.
  /// Wait after that; drawn evenly from in between, with the script's seed.
  double delay_min_s = 0.0, delay_max_s = 0.0;
  int times = 1;  ///< It happens that often; 0: every time.
};

/// Pulling the plug; put back after the fault's `for_s`, or never.
struct UnplugFault {};
/// Every transfer takes so long.
struct SlowFault {
  std::chrono::microseconds latency;
};
/// A force from outside on one cell, as of a hand on its cord.
struct AddedForceFault {
  double force_N;
};
/// Of a camera; all of them last.
struct CameraFault {
  enum class Kind { kLostPackets, kUnplugged, kFrozen, kSaturated, kSwapped, kDefocused };
  Kind kind = Kind::kFrozen;
  double lost_share = 0.0;  ///< kLostPackets: of the packets, 0 to 1.
  double blur_px = 0.0;     ///< kDefocused: one sigma.
  int other = 0;            ///< kSwapped: the camera whose cable it has then.
};
using FaultKind = std::variant<VirtualFault, UnplugFault, SlowFault, VirtualCellFault,
                               AddedForceFault, CameraFault>;

struct ScriptedFault {
  std::string name;       ///< For the log and for `after`: "fault-1" unless given.
  std::string kind_name;  ///< As in the script.
  int device = 0;         ///< Of the axes, the cells or the cameras, from 0.
  bool on_axis = false, on_camera = false;  ///< Neither: of a cell.
  FaultKind kind;
  FaultTrigger trigger;
  int count = 0;                ///< Transfers or requests that it befalls; 0: until it ends.
  std::optional<double> for_s;  ///< Ends after that; without, what lasts stays.

  std::string deviceName() const;  ///< "axis-3", "cell-5", "camera-2".
};

/// Faults that `tenter twin serve --fault` plays; docs/formats/fault-script.md.
struct FaultScript {
  std::uint64_t seed = 1;
  std::vector<ScriptedFault> faults;
};

/// Names that an axis', a cell's or a camera's `kind` may have.
std::vector<std::string> axisFaultNames();
std::vector<std::string> cellFaultNames();
std::vector<std::string> cameraFaultNames();

/// The rig that a script is for. Modbus TCP, for one, has no checksum to break.
struct FaultScriptRig {
  int axes = 0;
  bool tcp = true;
  int cameras = 0;
};
/// The error names file, key and reason.
Result<FaultScript> readFaultScript(const std::filesystem::path& file, const FaultScriptRig& rig);
Result<FaultScript> parseFaultScript(std::string_view toml, const std::string& file,
                                     const FaultScriptRig& rig);

}  // namespace tenter
