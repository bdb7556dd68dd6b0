// SPDX-License-Identifier: GPL-3.0-or-later
#include "journal_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "record_codec.h"

namespace tenter {

namespace fs = std::filesystem;

namespace {

/// Room is asked for in steps of that much, so that few appends ask.
constexpr std::int64_t kStep_bytes = 1 << 20;

bool meansFull(int code) { return code == ENOSPC || code == EDQUOT || code == EFBIG; }

}  // namespace

Result<Descriptor> lockJournal(const fs::path& file) {
  // O_NONBLOCK and O_NOFOLLOW: a pipe or a link in its place must neither hang nor lead elsewhere.
  Descriptor fd(::open(file.c_str(), O_RDWR | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW));
  if (!fd.valid()) return fileError(file, "cannot be opened for writing", errno);
  struct stat status {};
  if (::fstat(fd.get(), &status) != 0) return fileError(file, "cannot be read", errno);
  if (!S_ISREG(status.st_mode)) return badInput(file.string(), "", "is not a regular file");
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return fileError(file, "cannot be locked", errno);
    return badInput(file.string(), "", "is being written by another program",
                    "wait for it to end, or stop it");
  }
  return fd;
}

std::unique_ptr<JournalFile> JournalFile::open(fs::path file, Descriptor lock,
                                               std::int64_t size_bytes, std::uint64_t next_sequence,
                                               std::chrono::nanoseconds commit_interval) {
  return std::unique_ptr<JournalFile>(new JournalFile(std::move(file), std::move(lock), size_bytes,
                                                      next_sequence, commit_interval));
}

JournalFile::JournalFile(fs::path file, Descriptor fd, std::int64_t size_bytes,
                         std::uint64_t next_sequence, std::chrono::nanoseconds commit_interval)
    : file_(std::move(file)),
      fd_(std::move(fd)),
      commit_interval_(commit_interval),
      size_bytes_(size_bytes),
      reserved_end_(size_bytes),
      next_sequence_(next_sequence),
      committed_(next_sequence),
      committer_([this](const std::stop_token& stop) { commitPeriodically(stop); }) {}

JournalFile::~JournalFile() { (void)close(); }

Result<void> JournalFile::makeRoom(std::int64_t bytes, bool may_use_reserve) {
  const std::int64_t wanted = size_bytes_ + bytes + kReserve_bytes;
  if (!can_reserve_ || wanted <= reserved_end_) return {};
  for (const std::int64_t end : {wanted + kStep_bytes, wanted}) {
    int code = 0;
    do {
      code = ::fallocate(fd_.get(), FALLOC_FL_KEEP_SIZE, size_bytes_, end - size_bytes_) == 0
                 ? 0
                 : errno;
    } while (code == EINTR);
    if (code == 0) {
      reserved_end_ = end;
      return {};
    }
    if (!meansFull(code)) {
      can_reserve_ = false;
      return {};
    }
  }
  if (may_use_reserve) return {};
  return fileError(file_, "cannot grow", ENOSPC);
}

Result<void> JournalFile::write(std::string_view line) {
  const int code = writeAll(fd_.get(), line);
  if (code == 0) return {};
  // A part of the line may be there: without it the file ends as it did.
  if (::ftruncate(fd_.get(), size_bytes_) != 0) {
    broken_ = fileError(file_, "ends in half a record and cannot be cut", errno);
  }
  reserved_end_ = size_bytes_;
  return fileError(file_, "cannot be written", code);
}

Result<std::uint64_t> JournalFile::append(std::string_view encoded, bool may_use_reserve) {
  const std::lock_guard lock(mutex_);
  require(!closed_, "append to a closed journal");
  if (broken_) return *broken_;
  line_.clear();
  appendSealed(line_, withSequence(next_sequence_, encoded));
  const auto bytes = static_cast<std::int64_t>(line_.size());
  if (auto done = makeRoom(bytes, may_use_reserve); !done) return done.error();
  if (auto done = write(line_); !done) return done.error();
  size_bytes_ += bytes;
  appended_.notify_one();
  return next_sequence_++;
}

Result<void> JournalFile::sync() {
  std::uint64_t appended = 0;
  {
    const std::lock_guard lock(mutex_);
    if (broken_) return *broken_;
    appended = next_sequence_;
    if (committed_ == appended) return {};
  }
  const int code = ::fsync(fd_.get()) == 0 ? 0 : errno;
  const std::lock_guard lock(mutex_);
  // The kernel may have dropped the pages that it could not write; trying again would prove
  // nothing.
  if (code != 0) broken_ = fileError(file_, "cannot be synced", code);
  if (broken_) return *broken_;
  committed_ = std::max(committed_, appended);
  return {};
}

Result<void> JournalFile::close() {
  committer_.request_stop();
  if (committer_.joinable()) committer_.join();
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return {};
    closed_ = true;
    if (!broken_ && reserved_end_ > size_bytes_) ::ftruncate(fd_.get(), size_bytes_);
  }
  auto done = sync();
  ::flock(fd_.get(), LOCK_UN);  // The next writer need not wait for this object's end.
  return done;
}

void JournalFile::commitPeriodically(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (appended_.wait(lock, stop, [this] { return committed_ < next_sequence_; })) {
    // The oldest record waits this long; others join it.
    appended_.wait_for(lock, stop, commit_interval_, [] { return false; });
    lock.unlock();
    const bool done = sync().ok();
    lock.lock();
    if (!done) return;  // The next append returns the error.
  }
}

std::uint64_t JournalFile::records() const {
  const std::lock_guard lock(mutex_);
  return next_sequence_;
}

std::uint64_t JournalFile::committed() const {
  const std::lock_guard lock(mutex_);
  return committed_;
}

}  // namespace tenter
