// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>

#include "tenter/rig/actuator.h"
#include "usb_transport.h"

namespace tenter {

/// How an operation stands to the halt of an axis.
enum class OperationKind {
  kPlain,   ///< A halt cuts it short.
  kMotion,  ///< So too, and it is refused after a halt.
  kHalt,    ///< Cuts short what is under way and refuses motion from then on.
};

/// A mutex that can be waited for until a moment; taken with std::unique_lock. (The thread
/// sanitizer of GCC 12 does not know std::timed_mutex.)
class AxisMutex {
 public:
  bool try_lock_until(std::chrono::steady_clock::time_point deadline);  // NOLINT: std's name
  void unlock();

 private:
  std::mutex mutex_;
  std::condition_variable freed_;
  bool held_ = false;
};

/// What is behind an Actuator.
class ActuatorCore {
 public:
  ActuatorCore(AxisConfig axis_config, std::shared_ptr<UsbTransport> usb);

  std::shared_ptr<UsbLink> link() const;
  void setLink(std::shared_ptr<UsbLink> link);
  /// Forbids motion and cancels what is pending, without waiting for anything.
  void preempt();

  const AxisConfig config;
  const ActuatorDriverRow& row;
  const std::shared_ptr<UsbTransport> transport;
  AxisMutex operation;  ///< Held by the operation under way; guards `driver`.
  std::unique_ptr<ActuatorDriver> driver;
  std::atomic<bool> motion_forbidden{false};
  std::atomic<unsigned> halts{0};

 private:
  mutable std::mutex link_mutex_;
  std::shared_ptr<UsbLink> link_;
};

/// What one axis is to do.
struct AxisTask {
  ActuatorCore* axis;
  std::function<UsbScript(ActuatorDriver&)> script;
  OperationKind kind = OperationKind::kPlain;
  /// Called on success while the axis is still held, to take what the driver has read.
  std::function<void(const ActuatorDriver&)> take;
};

/// Runs all tasks at the same time and returns their outcomes in the same order, within twice
/// `timeout`. Precondition: each axis at most once.
std::vector<AxisOutcome> runTogether(const std::vector<AxisTask>& tasks,
                                     std::chrono::milliseconds timeout);

}  // namespace tenter
