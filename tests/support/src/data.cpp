// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/test_support/data.h"

#include <cstdlib>

namespace tenter::test_support {

namespace fs = std::filesystem;

std::optional<fs::path> findData() {
  const char* chosen = std::getenv("TENTER_DATA");
  const fs::path folder =
      chosen != nullptr ? fs::path(chosen) : sourceFolder().parent_path() / "shared" / "data";
  std::error_code error;
  if (!fs::is_directory(folder, error)) return std::nullopt;
  return folder;
}

std::optional<fs::path> findData(const fs::path& name) {
  const auto folder = findData();
  std::error_code error;
  if (!folder || !fs::exists(*folder / name, error)) return std::nullopt;
  return *folder / name;
}

std::string noData() {
  return "no real measurements here: set TENTER_DATA to the folder that holds them";
}

fs::path sourceFolder() { return TENTER_SOURCE_FOLDER; }

}  // namespace tenter::test_support
