// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

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

/// Builds a folder under a temporary name beside `folder` and renames it into place when `build`
/// succeeds; removes it when `build` fails or throws. Refuses a `folder` that exists and is not
/// empty, unless it carries `replaceable_marker` (a file name such as "measurement.json"), in which
/// case the old one is swapped out.
Result<void> writeFolderAtomically(
    const std::filesystem::path& folder, const std::string& replaceable_marker,
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
