// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <system_error>

namespace tenter {

namespace fs = std::filesystem;

namespace {

std::string systemReason(int code) { return std::generic_category().message(code); }

/// Closes a file descriptor at the end of the scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

/// Removes a file or folder at the end of the scope unless it was kept.
class Scratch {
 public:
  explicit Scratch(fs::path path) : path_(std::move(path)) {}
  ~Scratch() {
    std::error_code ignored;
    if (!kept_) fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const fs::path& path() const { return path_; }
  void keep() { kept_ = true; }

 private:
  fs::path path_;
  bool kept_ = false;
};

/// A name beside `target` that no other process or thread uses.
fs::path temporaryNameFor(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  std::string name = ".";
  name += target.filename().string();
  name += ".part-" + std::to_string(::getpid()) + "-" + std::to_string(counter++);
  return target.parent_path() / name;
}

/// "dir/name/" has an empty file name and "name" an empty parent: both would put temporaries
/// elsewhere.
fs::path normalTarget(const fs::path& path) {
  fs::path target = fs::absolute(path).lexically_normal();
  return target.has_filename() ? target : target.parent_path();
}

void syncFolder(const fs::path& folder) {
  const Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() >= 0) ::fsync(fd.get());
}

Result<void> writeAndSync(const fs::path& file, std::string_view content) {
  const Descriptor fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (fd.get() < 0) return badInput("", "", "cannot be written: " + systemReason(errno));
  while (!content.empty()) {
    const ssize_t written = ::write(fd.get(), content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return badInput("", "", "cannot be written: " + systemReason(errno));
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  if (::fsync(fd.get()) != 0) return badInput("", "", "cannot be written: " + systemReason(errno));
  return {};
}

Result<void> prepareParent(const fs::path& target, const std::string& shown) {
  std::error_code error;
  fs::create_directories(target.parent_path(), error);
  if (error) {
    return badInput(shown, "", "its folder cannot be made: " + error.message());
  }
  return {};
}

bool holdsWorkingFolder(const fs::path& target) {
  std::error_code error;
  for (fs::path at = fs::current_path(error); !error && !at.empty(); at = at.parent_path()) {
    if (fs::equivalent(at, target, error)) return true;
    if (at == at.parent_path()) break;
  }
  return false;
}

bool hasMarker(const fs::path& folder, const FolderKind& kind) {
  constexpr std::streamsize kBeginning = 1 << 16;
  std::error_code error;
  if (kind.marker.empty() || !fs::is_regular_file(folder / kind.marker, error)) return false;
  std::ifstream in(folder / kind.marker, std::ios::binary);
  std::string text(static_cast<std::size_t>(kBeginning), '\0');
  in.read(text.data(), kBeginning);
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text.find(kind.marker_text) != std::string::npos;
}

bool belongsTo(const FolderKind& kind, const std::string& name) {
  const auto matches = [&name](const std::string& entry) {
    return entry.starts_with('*') ? name.ends_with(entry.substr(1)) : name == entry;
  };
  return name == kind.marker || std::any_of(kind.entries.begin(), kind.entries.end(), matches);
}

/// Puts `built` in the place of `target`; what was there ends up under `built`'s name. Where the
/// file system can exchange two names a kill leaves the old or the new folder, elsewhere possibly
/// none.
Result<void> swapIn(const fs::path& built, const fs::path& target, const std::string& shown) {
  if (::rename(built.c_str(), target.c_str()) == 0) return {};
  if (::renameat2(AT_FDCWD, built.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE) == 0) {
    return {};
  }
  Scratch old(temporaryNameFor(target));
  std::error_code error;
  fs::rename(target, old.path(), error);
  if (error) return badInput(shown, "", "cannot be replaced: " + error.message());
  fs::rename(built, target, error);
  if (!error) return {};
  std::error_code restore_error;
  fs::rename(old.path(), target, restore_error);
  if (restore_error) old.keep();
  return badInput(shown, "", "cannot be put in place: " + error.message());
}

}  // namespace

Result<std::string> readFile(const fs::path& file, std::size_t limit_bytes) {
  const std::string shown = file.string();
  // O_NONBLOCK: a named pipe in the place of a file must not hang the program.
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (fd.get() < 0) {
    const std::string advice = errno == ENOENT ? "check the path" : "";
    return badInput(shown, "", "cannot be read: " + systemReason(errno), advice);
  }
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) return badInput(shown, "", systemReason(errno));
  if (S_ISDIR(status.st_mode)) return badInput(shown, "", "is a folder", "name a file");
  if (!S_ISREG(status.st_mode)) return badInput(shown, "", "is not a regular file");
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size > limit_bytes) {
    return badInput(shown, "",
                    "has " + std::to_string(size) + " bytes, more than the limit of " +
                        std::to_string(limit_bytes));
  }
  std::string content(size, '\0');
  std::size_t done = 0;
  while (done < size) {
    const ssize_t count = ::read(fd.get(), content.data() + done, size - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return badInput(shown, "", "cannot be read: " + systemReason(errno));
    if (count == 0) return badInput(shown, "", "became shorter while it was read");
    done += static_cast<std::size_t>(count);
  }
  return content;
}

Result<void> writeFileAtomically(const fs::path& file, std::string_view content) {
  const std::string shown = file.string();
  const fs::path target = normalTarget(file);
  if (auto done = prepareParent(target, shown); !done) return done;
  std::error_code error;
  if (fs::is_directory(target, error)) return badInput(shown, "", "is a folder", "name a file");
  Scratch scratch(temporaryNameFor(target));
  if (auto done = writeAndSync(scratch.path(), content); !done) return done.error().in(shown);
  fs::rename(scratch.path(), target, error);
  if (error) return badInput(shown, "", "cannot be put in place: " + error.message());
  scratch.keep();
  syncFolder(target.parent_path());
  return {};
}

Result<void> checkFolderReplaceable(const fs::path& folder, const FolderKind& kind) {
  const std::string shown = folder.string();
  const fs::path target = normalTarget(folder);
  std::error_code error;
  const fs::file_status status = fs::symlink_status(target, error);
  if (!fs::exists(status)) return {};
  if (!fs::is_directory(status)) {
    return badInput(shown, "", "exists and is not a folder", "choose another name");
  }
  if (holdsWorkingFolder(target)) {
    return badInput(shown, "", "is the folder in which you work, or one above it",
                    "name a new folder");
  }
  if (fs::is_empty(target, error) && !error) return {};
  constexpr const char* kAdvice = "choose another name or empty the folder";
  if (!hasMarker(target, kind)) {
    return badInput(shown, "", "exists and was not written by tenter for this purpose", kAdvice);
  }
  for (fs::directory_iterator at(target, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (!belongsTo(kind, name)) {
      return badInput(shown, "", "holds '" + name + "', which replacing it would destroy", kAdvice);
    }
  }
  if (error) return badInput(shown, "", "cannot be read: " + error.message());
  return {};
}

Result<void> writeFolderAtomically(const fs::path& folder, const FolderKind& kind,
                                   const std::function<Result<void>(const fs::path&)>& build) {
  const std::string shown = folder.string();
  const fs::path target = normalTarget(folder);
  if (auto done = checkFolderReplaceable(folder, kind); !done) return done;
  if (auto done = prepareParent(target, shown); !done) return done;
  Scratch scratch(temporaryNameFor(target));
  std::error_code error;
  fs::create_directory(scratch.path(), error);
  if (error) return badInput(shown, "", "cannot be made: " + error.message());
  if (auto done = build(scratch.path()); !done) return done;
  syncFolder(scratch.path());
  // The world may have moved on while the folder was being built.
  if (auto done = checkFolderReplaceable(folder, kind); !done) return done;
  if (auto done = swapIn(scratch.path(), target, shown); !done) return done;
  syncFolder(target.parent_path());
  return {};
}

}  // namespace tenter
