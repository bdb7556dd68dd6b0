// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace tenter::test_support {

/// The folder of real measurements: $TENTER_DATA, else ../shared/data beside the source folder;
/// nothing if absent.
std::optional<std::filesystem::path> findData();

/// A file or folder in there, such as "nylon-offaxis/angle-00.csv"; nothing if absent.
std::optional<std::filesystem::path> findData(const std::filesystem::path& name);

/// What a test says when it skips for want of real data: GTEST_SKIP() << noData().
std::string noData();

/// The root of the source tree, for schemas and scripts.
std::filesystem::path sourceFolder();

}  // namespace tenter::test_support
