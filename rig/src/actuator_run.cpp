// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "actuator_core.h"

namespace tenter {
namespace {

using Clock = std::chrono::steady_clock;

/// One task under way: holds its axis from construction to destruction.
class RunningTask {
 public:
  RunningTask(const AxisTask& task, Clock::time_point deadline, std::shared_ptr<UsbBell> bell)
      : task_(task), deadline_(deadline), bell_(std::move(bell)) {
    outcome_.axis = task.axis->config.name;
  }

  void begin() {
    held_ = std::unique_lock(task_.axis->operation, deadline_);
    if (!held_.owns_lock()) return end(ActuatorFault::kTimeout, "an earlier order has not ended");
    halts_ = task_.axis->halts;
    if (task_.kind == OperationKind::kMotion && task_.axis->motion_forbidden) {
      return end(ActuatorFault::kHalted, "");
    }
    link_ = task_.axis->link();
    if (link_ == nullptr) return end(ActuatorFault::kUnplugged, "");
    script_ = task_.script(*task_.axis->driver);
    advance(nullptr);
  }

  /// Goes on with whatever has completed.
  void poll() {
    while (!ended_ && transfer_->done()) {
      const std::shared_ptr<UsbTransfer> answered = std::move(transfer_);
      const UsbReply& reply = answered->reply();
      if (reply.fault != ActuatorFault::kNone) {
        return end(faultSeen(reply.fault), answered->request().name());
      }
      advance(&reply);
    }
  }

  /// The time is over: asks libusb to give up what it has not yet given up itself.
  void cancel() {
    if (!ended_) transfer_->cancel();
  }
  void abandon() {
    if (!ended_) end(ActuatorFault::kTimeout, transfer_->request().name());
  }

  bool ended() const { return ended_; }
  const AxisOutcome& outcome() const { return outcome_; }

 private:
  bool preempted() const {
    return task_.kind != OperationKind::kHalt && task_.axis->halts != halts_;
  }

  /// A transfer that we cancelled because time was over has not been preempted.
  ActuatorFault faultSeen(ActuatorFault fault) const {
    if (fault == ActuatorFault::kPreempted && !preempted()) return ActuatorFault::kTimeout;
    return fault;
  }

  void advance(const UsbReply* previous) {
    if (previous != nullptr && preempted()) return end(ActuatorFault::kPreempted, "");
    UsbStep step = script_(previous);
    if (!step.request) {
      if (step.fault == ActuatorFault::kNone && task_.take) task_.take(*task_.axis->driver);
      return end(step.fault, std::move(step.detail));
    }
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline_ - Clock::now());
    if (left.count() <= 0) return end(ActuatorFault::kTimeout, step.request->name());
    transfer_ = link_->submit(std::move(*step.request), left, bell_);
  }

  void end(ActuatorFault fault, std::string detail) {
    outcome_.fault = fault;
    outcome_.detail = std::move(detail);
    ended_ = true;
    // A handle of a device that has gone stays dead even if the device comes back.
    if (fault == ActuatorFault::kUnplugged && link_ != nullptr) task_.axis->setLink(nullptr);
  }

  const AxisTask& task_;
  Clock::time_point deadline_;
  std::shared_ptr<UsbBell> bell_;
  std::unique_lock<AxisMutex> held_;
  unsigned halts_ = 0;
  std::shared_ptr<UsbLink> link_;
  UsbScript script_;
  std::shared_ptr<UsbTransfer> transfer_;
  AxisOutcome outcome_;
  bool ended_ = false;
};

/// Waits for completions and goes on with their tasks, until all have ended or `until`.
void pump(std::vector<RunningTask>& running, UsbBell& bell, unsigned& rings,
          Clock::time_point until) {
  const auto all_ended = [&] {
    return std::all_of(running.begin(), running.end(), [](const auto& t) { return t.ended(); });
  };
  for (;;) {
    for (RunningTask& task : running) task.poll();
    if (all_ended() || Clock::now() >= until) return;
    rings = bell.wait(rings, until);
  }
}

}  // namespace

bool AxisMutex::try_lock_until(Clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  if (!freed_.wait_until(lock, deadline, [this] { return !held_; })) return false;
  held_ = true;
  return true;
}

void AxisMutex::unlock() {
  // Under the lock: the next holder may end the life of this mutex.
  const std::lock_guard lock(mutex_);
  held_ = false;
  freed_.notify_one();
}

std::vector<AxisOutcome> runTogether(const std::vector<AxisTask>& tasks,
                                     std::chrono::milliseconds timeout) {
  require(timeout.count() > 0, "an operation needs a time-out above zero");
  const Clock::time_point deadline = Clock::now() + timeout;
  // libusb ends each transfer at the deadline by itself; the grace is for its word to arrive.
  const Clock::time_point last_word = deadline + timeout / 2;
  const Clock::time_point end = deadline + timeout * 9 / 10;
  for (const AxisTask& task : tasks) {
    if (task.kind == OperationKind::kHalt) task.axis->preempt();
  }
  const auto bell = std::make_shared<UsbBell>();
  unsigned rings = 0;
  std::vector<RunningTask> running;
  running.reserve(tasks.size());
  for (const AxisTask& task : tasks) running.emplace_back(task, deadline, bell);
  for (RunningTask& task : running) task.begin();
  pump(running, *bell, rings, last_word);
  for (RunningTask& task : running) task.cancel();
  pump(running, *bell, rings, end);
  std::vector<AxisOutcome> outcomes;
  for (RunningTask& task : running) {
    task.abandon();
    outcomes.push_back(task.outcome());
  }
  return outcomes;
}

}  // namespace tenter
