// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/acquisition/camera_bank.h"

#include <algorithm>
#include <thread>

#include "camera_worker.h"

namespace tenter {
namespace {

using namespace std::chrono_literals;

/// Beyond the set's own time-out, for a camera whose control channel is slow to confirm.
constexpr std::chrono::milliseconds kGrace = 500ms;
constexpr auto kPoll = 20ms;
constexpr int kPairings = 8;

/// Taking the set again may cure it.
bool isCurable(FrameFault fault) {
  return isLost(fault) && fault != FrameFault::kNotConnected && fault != FrameFault::kSwapped;
}

std::optional<std::int64_t> skewOf(const FrameSet& set, bool common_clock) {
  std::int64_t first_ns = 0, last_ns = 0;
  int seen = 0;
  for (const SetFrame& frame : set.frames) {
    if (isLost(frame.fault)) continue;
    const std::int64_t from_ns = common_clock ? frame.image.camera_ns : frame.trigger_ns;
    const std::int64_t to_ns = common_clock ? frame.image.camera_ns : frame.confirmed_ns;
    first_ns = seen == 0 ? from_ns : std::min(first_ns, from_ns);
    last_ns = seen == 0 ? to_ns : std::max(last_ns, to_ns);
    ++seen;
  }
  if (seen == 0) return std::nullopt;
  return last_ns - first_ns;
}

/// All cameras look at one cloth, so one that is much less sharp than most of them is out of focus,
/// though it never was in.
void compareSharpness(std::vector<SetFrame>& frames, double share) {
  constexpr std::size_t kFewest = 3;
  std::vector<double> values;
  for (const SetFrame& frame : frames) {
    if (frame.fault == FrameFault::kNone) values.push_back(frame.quality.sharpness);
  }
  if (values.size() < kFewest) return;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  for (SetFrame& frame : frames) {
    if (frame.fault == FrameFault::kNone && frame.quality.sharpness < share * *middle) {
      frame.fault = FrameFault::kBlurred;
      frame.detail = "far less sharp than the other cameras";
    }
  }
}

}  // namespace

bool FrameSet::complete() const {
  return std::none_of(frames.begin(), frames.end(),
                      [](const SetFrame& frame) { return isLost(frame.fault); });
}

CameraBank::CameraBank(CameraSection section, CameraOpener opener) : section_(std::move(section)) {
  for (const CameraConfig& camera : section_.cameras) {
    workers_.push_back(std::make_unique<CameraWorker>(camera, section_, opener));
  }
}

CameraBank::~CameraBank() = default;

bool CameraBank::awaitAll(std::chrono::milliseconds timeout) {
  const auto until = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    const bool all = std::all_of(workers_.begin(), workers_.end(),
                                 [](const auto& worker) { return worker->connected(); });
    if (all || std::chrono::steady_clock::now() >= until) return all;
    std::this_thread::sleep_for(kPoll);
  }
}

std::vector<CameraStatus> CameraBank::status() const {
  std::vector<CameraStatus> all;
  for (const auto& worker : workers_) all.push_back(worker->status());
  return all;
}

FrameSet CameraBank::takeSet() {
  const std::lock_guard lock(taking_);
  FrameSet set;
  set.number = sets_++;
  for (int i = 0; i <= section_.retakes; ++i) {
    set.retakes = i;
    attempt(set, i);
    const bool curable = std::any_of(set.frames.begin(), set.frames.end(),
                                     [](const SetFrame& frame) { return isCurable(frame.fault); });
    if (!curable) break;
  }
  for (std::size_t i = 0; i < workers_.size(); ++i) workers_[i]->noteFault(set.frames[i].fault);
  set.skew_ns = skewOf(set, section_.common_clock);
  set.done_ns = steadyNow_ns();
  return set;
}

void CameraBank::attempt(FrameSet& set, int attempt) {
  const std::int64_t now_ns = steadyNow_ns();
  const std::int64_t deadline_ns = now_ns + std::chrono::nanoseconds(section_.set_timeout).count();
  set.time_ns = now_ns;
  set.frames.assign(workers_.size(), SetFrame());
  std::vector<std::shared_ptr<FrameOrder>> orders;
  for (std::size_t i = 0; i < workers_.size(); ++i) {
    orders.push_back(workers_[i]->order(
        std::make_shared<FrameOrder>(FrameWish{!section_.hardware_trigger, true, deadline_ns}),
        set.frames[i]));
  }
  for (std::size_t i = 0; i < orders.size(); ++i) {
    if (!orders[i]) continue;
    auto frame = orders[i]->await(deadline_ns + std::chrono::nanoseconds(kGrace).count());
    if (frame) {
      set.frames[i] = *std::move(frame);
    } else {
      set.frames[i].fault = FrameFault::kNoAnswer;
      set.frames[i].detail = "its driver does not come back";
    }
  }
  if (section_.hardware_trigger) pair(set);
  compareSharpness(set.frames, section_.blurred_share);
  for (std::size_t i = 0; i < set.frames.size(); ++i) {
    const SetFrame& frame = set.frames[i];
    if (frame.trigger_ns > 0) set.time_ns = std::min(set.time_ns, frame.trigger_ns);
    if (frame.fault == FrameFault::kNone) continue;
    set.events.push_back({static_cast<int>(i), attempt, frame.fault, frame.detail});
  }
}

/// Nobody knows when a pulse comes, so one may have come while the cameras were being asked: those
/// whose frame is of the pulse before take one more.
void CameraBank::pair(FrameSet& set) {
  const std::int64_t window_ns = std::chrono::nanoseconds(section_.pair_window).count();
  for (int round = 0; round < kPairings; ++round) {
    std::int64_t last_ns = 0;
    for (const SetFrame& frame : set.frames) {
      if (!isLost(frame.fault)) last_ns = std::max(last_ns, frame.confirmed_ns);
    }
    bool all_paired = true;
    for (std::size_t i = 0; i < set.frames.size(); ++i) {
      SetFrame& frame = set.frames[i];
      if (isLost(frame.fault) || last_ns - frame.confirmed_ns <= window_ns) continue;
      all_paired = false;
      const std::int64_t deadline_ns =
          steadyNow_ns() + std::chrono::nanoseconds(section_.set_timeout).count();
      const auto order = workers_[i]->order(
          std::make_shared<FrameOrder>(FrameWish{false, false, deadline_ns}), frame);
      if (!order) continue;
      auto next = order->await(deadline_ns + std::chrono::nanoseconds(kGrace).count());
      if (next) frame = *std::move(next);
      if (!next) frame.fault = FrameFault::kNoAnswer;
    }
    if (all_paired) return;
  }
  for (SetFrame& frame : set.frames) {
    if (!isLost(frame.fault)) frame.fault = FrameFault::kStale;
  }
}

}  // namespace tenter
