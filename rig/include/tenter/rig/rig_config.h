// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/rig/actuator_driver.h"
#include "tenter/rig/load_cell.h"

namespace tenter {

/// What no motion of the rig may exceed. Forces are of one cell, gross: against the amplifier's
/// zero, so that no tare moves them.
struct RigLimits {
  double absolute_N = 0.0;  ///< Beyond it all axes halt.
  double working_N = 0.0;   ///< Beyond it nothing loads any further; below absolute_N.
  double slack_N = 0.0;     ///< Against the tare; a cord below it counts as unloaded.
  double slope_N_per_s = 0.0;
  double stiffest_sample_N_per_m = 0.0;
  double following_error_m = 0.0;  ///< Between where an axis should be and where it is.
};

/// All axes that draw in cords may together do so no faster than this, so that a sample of the
/// stiffest kind takes 0.25 s from the working force to the absolute one:
///   (absolute_N - working_N) / (stiffest_sample_N_per_m * 0.25 s)
double speedCap_m_per_s(const RigLimits& limits);

/// One axis; its position grows as it loads the sample.
struct RigAxis {
  AxisConfig device;
  std::optional<int> cell;  ///< The cell on its cord, if it has one.
};

/// The rig as `docs/formats/rig.md` describes its file.
struct RigConfig {
  std::string name;
  RigLimits limits;
  std::vector<RigAxis> axes;
  std::vector<LoadCellConfig> cells;
  /// "cells", "cords" to the id of the calibration that the file names.
  std::map<std::string, std::string> calibration_ids;
  std::string text;  ///< The file, byte for byte.

  std::optional<int> findAxis(std::string_view axis_name) const;
};

/// The error names file, key and reason. Register maps are shipped ones by name, or files beside
/// this one. No axis is configured faster than the speed cap. Calibrations that it names are read:
/// cells get their gain and zero; one that was rejected, or lacks a cell, is an error.
Result<RigConfig> readRigConfig(const std::filesystem::path& file);
Result<RigConfig> parseRigConfig(std::string_view toml, const std::filesystem::path& file);
/// One that a session holds: its register maps are not looked for, cells have none.
Result<RigConfig> parseRecordedRigConfig(std::string_view toml);

}  // namespace tenter
