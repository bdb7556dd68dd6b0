// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>

#include "tenter/core/result.h"

namespace tenter::app {

// A command overwrites only what this program wrote; asked before the work, so that no long run
// ends in a refusal.

/// Error if the file exists without `marker` in it, or is no file.
Result<void> checkOutputFile(const std::filesystem::path& file, std::string_view marker);
/// Error if the file exists and is no material file.
Result<void> checkMaterialOutput(const std::filesystem::path& file);
/// Error if the folder holds something but not the file `marker`, or is no folder.
Result<void> checkOutputFolder(const std::filesystem::path& folder, std::string_view marker);
/// Error if the folder holds anything: what a rig has recorded is never replaced.
Result<void> checkNewFolder(const std::filesystem::path& folder);

/// Marks a folder as a measurement.
inline constexpr std::string_view kMeasurementMarker = "measurement.json";

}  // namespace tenter::app
