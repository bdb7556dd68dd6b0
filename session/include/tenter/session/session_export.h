// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "tenter/core/result.h"

namespace tenter {

/// A file format that a session can be handed on in.
struct SessionExport {
  std::string_view id, description;
  std::string_view marker;  ///< Bytes near the beginning of every file that it writes.
  /// Writes `file`, complete or absent. A torn tail is left out; damage before it is an error.
  Result<void> (*write)(const std::filesystem::path& session, const std::filesystem::path& file);
};

/// All of them. To add one: its file in src, and one row in session_export.cpp.
std::span<const SessionExport> sessionExports();

/// Error names the formats there are.
Result<const SessionExport*> findSessionExport(std::string_view id);

/// HDF5 in NeXus layout: NXentry with user, sample, instrument, NXdata of tensions and positions,
/// lists of frames, phases and events. Not to be called from two threads at once: neither is HDF5.
Result<void> exportSessionToHdf5(const std::filesystem::path& session,
                                 const std::filesystem::path& file);

}  // namespace tenter
