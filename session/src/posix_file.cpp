// SPDX-License-Identifier: GPL-3.0-or-later
#include "posix_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <system_error>

namespace tenter {

namespace fs = std::filesystem;

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

Error fileError(const fs::path& file, std::string_view what, int code) {
  const std::string advice =
      code == ENOSPC || code == EDQUOT || code == EFBIG ? "make room on the disk" : "";
  return badInput(file.string(), "",
                  std::string(what) + ": " + std::generic_category().message(code), advice);
}

Result<Descriptor> openForReading(const fs::path& file) {
  Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW));
  if (!fd.valid()) return fileError(file, "cannot be read", errno);
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) return fileError(file, "cannot be read", errno);
  if (!S_ISREG(status.st_mode)) return badInput(file.string(), "", "is not a regular file");
  return fd;
}

Result<JournalScanner::Source> journalSource(const fs::path& file) {
  auto opened = openForReading(file);
  if (!opened) return opened.error();
  auto fd = std::make_shared<Descriptor>(std::move(*opened));
  return JournalScanner::Source([fd, file](char* buffer, std::size_t size) -> Result<std::size_t> {
    while (true) {
      const ssize_t count = ::read(fd->get(), buffer, size);
      if (count >= 0) return static_cast<std::size_t>(count);
      if (errno != EINTR) return fileError(file, "cannot be read", errno);
    }
  });
}

int writeAll(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

Result<void> writeNewFile(const fs::path& file, std::string_view bytes) {
  const Descriptor fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (!fd.valid()) return fileError(file, "cannot be written", errno);
  int code = writeAll(fd.get(), bytes);
  if (code == 0 && ::fdatasync(fd.get()) != 0) code = errno;
  if (code == 0) return {};
  ::unlink(file.c_str());
  return fileError(file, "cannot be written", code);
}

Result<void> syncFolder(const fs::path& folder) {
  const Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd.valid() || ::fsync(fd.get()) != 0) return fileError(folder, "cannot be synced", errno);
  return {};
}

}  // namespace tenter
