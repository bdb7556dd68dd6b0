// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/core/types.h"

namespace tenter {

/// The whole file as bytes; error if it is missing, unreadable, a folder, or larger than
/// `limit_bytes`.
Result<std::string> readFile(const std::filesystem::path& file,
                             std::size_t limit_bytes = std::size_t{1} << 30);

/// Writes a file so that it is complete or absent: temporary name beside it, fsync, rename, fsync
/// of the folder.
Result<void> writeFileAtomically(const std::filesystem::path& file, std::string_view content);

/// Folders of one kind that this program writes, and may therefore replace. The default: none.
struct FolderKind {
  std::string marker;                ///< The file that makes a folder one of the kind ...
  std::string marker_text;           ///< ... if it contains this near its beginning.
  std::vector<std::string> entries;  ///< What else is in it; "*.json" stands for all so ending.
};

/// Whether `folder` may be made, or made anew: absent, empty, or of this kind and without anything
/// that the kind does not have. Never the working folder nor one above it, which would be pulled
/// away from under the user.
Result<void> checkFolderReplaceable(const std::filesystem::path& folder, const FolderKind& kind);

/// Builds a folder under a temporary name beside `folder` and renames it into place when `build`
/// succeeds, where an older one of the kind is swapped out; removes it when `build` fails or
/// throws. Refuses what checkFolderReplaceable refuses.
Result<void> writeFolderAtomically(
    const std::filesystem::path& folder, const FolderKind& kind,
    const std::function<Result<void>(const std::filesystem::path&)>& build);

/// Lower-case hexadecimal SHA-256.
std::string sha256(std::string_view bytes);

/// SHA-256 over the sorted relative names and contents of all files below a folder, or of one file.
Result<std::string> sha256OfPath(const std::filesystem::path& path);

/// Numbers separated by commas, semicolons, tabs or blanks, one row a line; blank lines and lines
/// that begin with
/// '#' are skipped, one non-numeric first line is taken as a header. Every row must have `columns`
/// finite numbers. Error names line and column. Returns rows x columns.
Result<Eigen::MatrixXd> readNumericTable(const std::filesystem::path& file, int columns);

}  // namespace tenter
