// SPDX-License-Identifier: GPL-3.0-or-later
#include "recorder.h"

#include <algorithm>

#include "tenter/rig/load_cell.h"

namespace tenter::daemon {
namespace {

/// A disk that is so far behind will not catch up; 200 s of samples.
constexpr std::size_t kLongestQueue = 10'000;
/// A disk that takes so long over what it was given does not answer.
constexpr std::int64_t kLongestWrite_ns = 5'000'000'000;

}  // namespace

Recorder::Recorder(std::unique_ptr<SessionWriter> writer, std::int64_t start_ns)
    : writer_(std::move(writer)), start_ns_(start_ns), thread_([this] { write(); }) {}

Recorder::~Recorder() {
  close(monotonic_ns());
  thread_.join();
}

void Recorder::append(std::int64_t time_ns, RecordBody body) {
  const std::lock_guard lock(mutex_);
  if (close_ns_ >= 0 && expected_ == 0) return;
  if (queue_.size() >= kLongestQueue) {
    if (fault_.empty()) fault_ = "the disk does not keep up";
    return;
  }
  queue_.push_back({std::max<std::int64_t>(0, time_ns - start_ns_), std::move(body)});
  changed_.notify_one();
}

std::shared_ptr<void> Recorder::expectFrames() {
  const std::lock_guard lock(mutex_);
  ++expected_;
  return {this, [](Recorder* recorder) {
            const std::lock_guard inner(recorder->mutex_);
            --recorder->expected_;
            recorder->changed_.notify_one();
          }};
}

Result<FrameRecord> Recorder::addFrame(std::int64_t time_ns, std::span<const FrameImage> images) {
  auto added = writer_->addFrame(std::max<std::int64_t>(0, time_ns - start_ns_), images);
  if (added) return added;
  const std::lock_guard lock(mutex_);
  if (fault_.empty()) fault_ = added.error().message();
  return added;
}

void Recorder::close(std::int64_t time_ns) {
  const std::lock_guard lock(mutex_);
  if (close_ns_ < 0) close_ns_ = std::max<std::int64_t>(0, time_ns - start_ns_);
  changed_.notify_one();
}

bool Recorder::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

std::string Recorder::fault() const {
  const std::lock_guard lock(mutex_);
  if (fault_.empty() && writing_since_ns_ && monotonic_ns() - *writing_since_ns_ > kLongestWrite_ns)
    return writer_->folder().string() + ": the disk does not answer";
  return fault_;
}

std::int64_t Recorder::start_ns() const { return start_ns_; }
std::string Recorder::folder() const { return writer_->folder().string(); }

void Recorder::take(std::deque<Item> items) {
  for (const Item& item : items) {
    // What the machine went by need not wait for the disk one by one: its decisions do.
    const bool is_input = std::holds_alternative<GenericRecord>(item.body);
    const auto written =
        writer_->append(item.time_ns, item.body, is_input ? Commit::kGroup : Commit::kByKind);
    if (written) continue;
    const std::lock_guard lock(mutex_);
    if (fault_.empty()) fault_ = written.error().message();
  }
}

void Recorder::write() {
  for (;;) {
    std::deque<Item> items;
    bool last = false;
    {
      std::unique_lock lock(mutex_);
      const auto ends = [this] { return close_ns_ >= 0 && expected_ == 0; };
      changed_.wait(lock, [&] { return !queue_.empty() || ends(); });
      items.swap(queue_);
      last = ends();
      writing_since_ns_ = monotonic_ns();
    }
    take(std::move(items));
    if (!last) {
      const std::lock_guard lock(mutex_);
      writing_since_ns_.reset();
      continue;
    }
    const Result<void> done = writer_->close(close_ns_);
    const std::lock_guard lock(mutex_);
    writing_since_ns_.reset();
    if (!done && fault_.empty()) fault_ = done.error().message();
    closed_ = true;
    return;
  }
}

}  // namespace tenter::daemon
