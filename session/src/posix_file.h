// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "journal_line.h"
#include "tenter/core/result.h"

namespace tenter {

/// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  bool valid() const { return fd_ >= 0; }

 private:
  int fd_;
};

/// "cannot be written: No space left on device" for the errno `code`.
Error fileError(const std::filesystem::path& file, std::string_view what, int code);

/// A regular file for reading; never hangs on a pipe, never follows a link.
Result<Descriptor> openForReading(const std::filesystem::path& file);

/// Feeds a file to a scanner.
Result<JournalScanner::Source> journalSource(const std::filesystem::path& file);

/// Writes all bytes at the descriptor's place; 0 or the errno.
int writeAll(int fd, std::string_view bytes);

/// Creates a file that was not there, with its content on the disk (fdatasync). Removes it again on
/// failure.
Result<void> writeNewFile(const std::filesystem::path& file, std::string_view bytes);

/// Makes names in the folder as durable as the files.
Result<void> syncFolder(const std::filesystem::path& folder);

}  // namespace tenter
