// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tenter::test_support {

/// A new empty folder that goes away, with all in it, at the end of the scope.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::filesystem::path& name) const { return path_ / name; }

  /// Writes a file below the folder, makes its parent folders, returns its path. Throws on failure.
  std::filesystem::path write(const std::filesystem::path& name, std::string_view content) const;

 private:
  std::filesystem::path path_;
};

/// The whole file; throws std::runtime_error if it cannot be read.
std::string slurp(const std::filesystem::path& file);

/// Sorted names of what lies directly in a folder, hidden ones included.
std::vector<std::string> listFolder(const std::filesystem::path& folder);

}  // namespace tenter::test_support
