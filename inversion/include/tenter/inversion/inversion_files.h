// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tenter/inversion/inversion.h"

namespace tenter {

inline constexpr int kInversionSchemaVersion = 1;
/// Marks a folder as an inversion result.
inline constexpr const char* kInversionMarker = "certificate.json";

/// certificate.json (docs/formats/inversion.md). `provenance`: whatever the caller adds: file
/// names, options, version.
nlohmann::json certificateToJson(const InversionProblem& problem, const InversionResult& result,
                                 const nlohmann::json& provenance);

/// A folder with rest.obj, pose.vtp, contacts.vtp, strains.vtp and certificate.json: complete or
/// absent; replaces an older result there.
Result<void> writeInversion(const std::filesystem::path& folder, const InversionProblem& problem,
                            const InversionResult& result, const nlohmann::json& provenance);

}  // namespace tenter
