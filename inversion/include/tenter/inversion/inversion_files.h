// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tenter/core/files.h"
#include "tenter/inversion/feasible_range.h"

namespace tenter {

inline constexpr int kInversionSchemaVersion = 1;
/// The folder that writeInversion() makes.
const FolderKind& inversionFolder();

/// certificate.json (docs/formats/inversion.md). `provenance`: whatever the caller adds: file
/// names, options, version. `range`: of a search that the result belongs to.
nlohmann::json certificateToJson(const InversionProblem& problem, const InversionResult& result,
                                 const nlohmann::json& provenance,
                                 const FeasibleRange* range = nullptr);
nlohmann::json rangeToJson(const FeasibleRange& range);

/// A folder with rest.obj, pose.vtp, contacts.vtp, strains.vtp, certificate.json and, unless
/// `asked` is null, problem.json with it (problemToJson): complete or absent; replaces an older
/// result there.
Result<void> writeInversion(const std::filesystem::path& folder, const InversionProblem& problem,
                            const InversionResult& result, const nlohmann::json& provenance,
                            const nlohmann::json& asked = nullptr,
                            const FeasibleRange* range = nullptr);

}  // namespace tenter
