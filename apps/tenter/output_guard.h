// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>

#include "tenter/core/files.h"
#include "tenter/core/result.h"

namespace tenter::app {

// A command overwrites only what this program wrote; asked before the work, so that no long run
// ends in a refusal.

/// Error if the file exists without `marker` in it, or is no file.
Result<void> checkOutputFile(const std::filesystem::path& file, std::string_view marker);
/// Error if the file exists and is no material file.
Result<void> checkMaterialOutput(const std::filesystem::path& file);
/// Error if a folder of this kind cannot be put there, or would replace anything else.
Result<void> checkOutputFolder(const std::filesystem::path& folder, const FolderKind& kind);
/// Error if the folder holds anything: what a rig has recorded is never replaced.
Result<void> checkNewFolder(const std::filesystem::path& folder);

}  // namespace tenter::app
