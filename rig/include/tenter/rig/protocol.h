// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/rig/rig_config.h"

namespace tenter {

enum class StepEnd {
  kForce,   ///< The mean tension of the step's cords reaches `force_N`.
  kTravel,  ///< Each axis arrives at its target.
  kHold,    ///< `hold_s` are over; nothing moves.
};

struct ProtocolStep {
  StepEnd end = StepEnd::kHold;
  std::vector<std::string> axes;  ///< Those that move.
  double speed_m_per_s = 0.0;     ///< Of each axis.
  double force_N = 0.0;           ///< Against the tare; of one cord.
  double limit_m = 0.0;  ///< kForce: travel from the beginning of the run beyond which it failed.
  std::vector<double> targets_m;  ///< kTravel: from where the run began; one an axis.
  double hold_s = 0.0;
};

struct ProtocolPhase {
  std::string name;
  int cycles = 1;
  std::vector<ProtocolStep> steps;
};

/// What a capture does; `docs/formats/protocol.md` describes the file.
struct CaptureProtocol {
  std::string name, description;
  double capture_interval_s = 0.0;
  std::vector<ProtocolPhase> phases;
  std::string text;  ///< The file, byte for byte.
};

/// The error names file, key and reason.
Result<CaptureProtocol> readCaptureProtocol(const std::filesystem::path& file);
Result<CaptureProtocol> parseCaptureProtocol(std::string_view toml, const std::string& file);

/// Whether a rig may run it: its axes are there, a force end has cells, forces stay below the
/// working force, speeds below those of the axes and of the cap. Kind kInterlock; the place names
/// phase and step.
Result<void> checkAgainstRig(const CaptureProtocol& protocol, const RigConfig& rig);

}  // namespace tenter
