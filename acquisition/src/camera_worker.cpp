// SPDX-License-Identifier: GPL-3.0-or-later
#include "camera_worker.h"

#include <algorithm>

namespace tenter {
namespace {

using namespace std::chrono_literals;

constexpr auto kReopenPeriod = 1s;

std::chrono::milliseconds millisecondsUntil(std::int64_t deadline_ns) {
  return std::chrono::milliseconds(
      std::max<std::int64_t>(0, (deadline_ns - steadyNow_ns()) / 1'000'000));
}

SetFrame without(FrameFault fault, const std::string& detail) {
  SetFrame frame;
  frame.fault = fault;
  frame.detail = detail;
  return frame;
}

}  // namespace

std::int64_t steadyNow_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void FrameOrder::finish(SetFrame frame) {
  const std::lock_guard lock(mutex_);
  frame_ = std::move(frame);
  done_.notify_all();
}

std::optional<SetFrame> FrameOrder::await(std::int64_t until_ns) {
  std::unique_lock lock(mutex_);
  done_.wait_for(lock, millisecondsUntil(until_ns), [this] { return frame_.has_value(); });
  return std::move(frame_);
}

CameraWorker::CameraWorker(const CameraConfig& config, const CameraSection& section,
                           CameraOpener opener)
    : config_(config), section_(section), opener_(std::move(opener)), judge_(section) {
  status_.name = config.name;
  status_.fault = frameFaultName(FrameFault::kNotConnected);
  thread_ = std::thread([this] { run(); });
}

CameraWorker::~CameraWorker() {
  {
    const std::lock_guard lock(mutex_);
    quitting_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::shared_ptr<FrameOrder> CameraWorker::order(const std::shared_ptr<FrameOrder>& order,
                                                SetFrame& frame) {
  const std::lock_guard lock(mutex_);
  if (!status_.connected) {
    frame = without(absence_, status_.fault);
    return nullptr;
  }
  if (busy_ || order_) {
    frame = without(FrameFault::kNoAnswer, "is still at the set before");
    return nullptr;
  }
  order_ = order;
  changed_.notify_all();
  return order;
}

CameraStatus CameraWorker::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

bool CameraWorker::connected() const { return status().connected; }

void CameraWorker::noteFault(FrameFault fault) {
  const std::lock_guard lock(mutex_);
  if (status_.connected) status_.fault = frameFaultName(fault);
}

void CameraWorker::publish() {
  const CameraCounters counters = camera_->counters();
  const std::lock_guard lock(mutex_);
  status_.counters = counters;
}

void CameraWorker::run() {
  auto next_open = std::chrono::steady_clock::now();
  for (;;) {
    if (!camera_ && std::chrono::steady_clock::now() >= next_open) {
      open();
      next_open = std::chrono::steady_clock::now() + kReopenPeriod;
    }
    std::shared_ptr<FrameOrder> order;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kReopenPeriod / 5, [this] { return quitting_ || order_; });
      if (quitting_) break;
      order.swap(order_);
      busy_ = order != nullptr;
    }
    if (camera_ && camera_->gone()) close(FrameFault::kNotConnected, "the connection was lost");
    if (!order) continue;
    SetFrame frame = camera_ ? take(order->wish()) : without(FrameFault::kNotConnected, "");
    if (camera_ && silences_ > section_.retakes) {
      close(FrameFault::kNotConnected, "confirms triggers and sends nothing; it is opened anew");
    }
    {
      const std::lock_guard lock(mutex_);
      busy_ = false;
    }
    order->finish(std::move(frame));
  }
  if (camera_) close(FrameFault::kNotConnected, "");
}

void CameraWorker::open() {
  auto camera = opener_(config_, section_);
  if (!camera) return close(FrameFault::kNotConnected, camera.error().message());
  camera_ = *std::move(camera);
  const CameraIdentity identity = camera_->identity();
  {
    const std::lock_guard lock(mutex_);
    status_.identity = identity;
  }
  if (!config_.serial.empty() && identity.serial != config_.serial) {
    return close(FrameFault::kSwapped, "serial number " + identity.serial + " answers at " +
                                           identity.address + " instead of " + config_.serial);
  }
  judge_.forget();
  silences_ = 0;
  warmUp();
  publish();
  const std::lock_guard lock(mutex_);
  status_.connected = true;
  status_.fault.clear();
}

/// The first frames after a start are often incomplete, or of before.
void CameraWorker::warmUp() {
  for (int i = 0; i < section_.warm_up_sets; ++i) {
    if (!section_.hardware_trigger && !camera_->trigger()) return;
    (void)camera_->next(section_.hardware_trigger ? 0ms : section_.set_timeout);
  }
  camera_->drain();
}

void CameraWorker::close(FrameFault why, const std::string& detail) {
  {
    const std::lock_guard lock(mutex_);
    status_.connected = false;
    absence_ = why;
    status_.fault = std::string(frameFaultName(why)) + (detail.empty() ? "" : ": " + detail);
  }
  camera_.reset();
}

SetFrame CameraWorker::take(const FrameWish& wish) {
  if (wish.from_now) camera_->drain();
  SetFrame frame;
  frame.trigger_ns = frame.confirmed_ns = steadyNow_ns();
  if (wish.with_trigger) {
    judge_.triggered(frame.trigger_ns);
    const auto triggered = camera_->trigger();
    frame.confirmed_ns = steadyNow_ns();
    if (!triggered) {
      close(FrameFault::kNotConnected, triggered.error().message());
      frame.fault = FrameFault::kNoAnswer;
      frame.detail = triggered.error().message();
      return frame;
    }
  }
  frame = await(wish, std::move(frame));
  publish();
  return frame;
}

SetFrame CameraWorker::await(const FrameWish& wish, SetFrame frame) {
  bool saw_stale = false;
  for (;;) {
    FrameOutcome outcome = camera_->next(millisecondsUntil(wish.deadline_ns));
    if (outcome.fault == FrameFault::kNone && judge_.isStale(outcome.image)) {
      saw_stale = true;
      continue;
    }
    const bool nothing = outcome.fault == FrameFault::kNoFrame;
    silences_ = nothing && wish.with_trigger && !saw_stale ? silences_ + 1 : 0;
    if (outcome.fault != FrameFault::kNone) {
      if (nothing) judge_.missed();
      frame.fault = nothing && saw_stale ? FrameFault::kStale : outcome.fault;
      frame.detail = outcome.detail;
      return frame;
    }
    frame.image = std::move(outcome.image);
    if (!wish.with_trigger) frame.trigger_ns = frame.confirmed_ns = steadyNow_ns();
    judge_.judge(frame);
    if (isLost(frame.fault)) frame.image.pixels = {};
    return frame;
  }
}

}  // namespace tenter
