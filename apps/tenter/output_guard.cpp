// SPDX-License-Identifier: GPL-3.0-or-later
#include "output_guard.h"

#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

#include "tenter/mechanics/material.h"

namespace tenter::app {

namespace fs = std::filesystem;

namespace {

constexpr const char* kAdvice = "choose another name, or remove it";

std::string beginningOf(const fs::path& file) {
  constexpr std::streamsize kLimit = 1 << 20;
  std::ifstream in(file, std::ios::binary);
  std::string text(static_cast<std::size_t>(kLimit), '\0');
  in.read(text.data(), kLimit);
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

/// Whether something may be put below the nearest folder that is there: hours of a fit are not to
/// end at a folder that nobody may write to.
Result<void> checkPlace(const fs::path& output) {
  if (output.empty()) return usageError("the name of the output is empty");
  std::error_code error;
  fs::path folder = fs::absolute(output, error).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  do {
    folder = folder.parent_path();
  } while (folder != folder.parent_path() && !fs::exists(folder, error));
  const std::string shown = output.string();
  if (!fs::is_directory(folder, error)) {
    return badInput(shown, "", "cannot be written: " + folder.string() + " is not a folder");
  }
  if (::access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return badInput(
      shown, "",
      "cannot be written: " + folder.string() + ": " + std::generic_category().message(errno));
}

/// True where a file may be put without asking what is in it.
Result<bool> isFree(const fs::path& file) {
  std::error_code error;
  if (file.filename().empty()) return usageError("'" + file.string() + "' is not a file name");
  if (auto ok = checkPlace(file); !ok) return ok.error();
  const auto status = fs::status(file, error);
  if (!fs::exists(status)) return true;
  if (!fs::is_regular_file(status)) {
    return badInput(file.string(), "", "exists and is not a file", kAdvice);
  }
  return fs::file_size(file, error) == 0;
}

Error notOurs(const fs::path& path) {
  return badInput(path.string(), "", "exists and was not written by tenter", kAdvice);
}

}  // namespace

Result<void> checkOutputFile(const fs::path& file, std::string_view marker) {
  const auto free = isFree(file);
  if (!free.ok()) return free.error();
  if (*free || beginningOf(file).find(marker) != std::string::npos) return {};
  return notOurs(file);
}

Result<void> checkMaterialOutput(const fs::path& file) {
  const auto free = isFree(file);
  if (!free.ok()) return free.error();
  if (*free || readMaterial(file).ok()) return {};
  return notOurs(file);
}

Result<void> checkOutputFolder(const fs::path& folder, const FolderKind& kind) {
  if (auto ok = checkPlace(folder); !ok) return ok.error();
  return checkFolderReplaceable(folder, kind);
}

Result<void> checkNewFolder(const fs::path& folder) {
  std::error_code error;
  if (auto ok = checkPlace(folder); !ok) return ok.error();
  if (!fs::exists(folder, error) ||
      (fs::is_directory(folder, error) && fs::is_empty(folder, error)))
    return {};
  return badInput(folder.string(), "", "exists already", "choose another folder");
}

}  // namespace tenter::app
