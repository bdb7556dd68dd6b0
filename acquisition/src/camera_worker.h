// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>

#include "frame_judge.h"
#include "tenter/acquisition/camera_bank.h"

namespace tenter {

struct FrameWish {
  bool with_trigger = true;  ///< Else the next frame that comes by itself.
  bool from_now = true;      ///< What has arrived before does not count.
  std::int64_t deadline_ns = 0;
};

/// An order for one frame. Whoever gave it may go away before it is done.
class FrameOrder {
 public:
  explicit FrameOrder(const FrameWish& wish) : wish_(wish) {}
  const FrameWish& wish() const { return wish_; }

  void finish(SetFrame frame);
  /// Nothing if it is not done by then. Once.
  std::optional<SetFrame> await(std::int64_t until_ns);

 private:
  const FrameWish wish_;
  std::mutex mutex_;
  std::condition_variable done_;
  std::optional<SetFrame> frame_;
};

/// Owns one camera in a thread of its own: opens it, opens it again, takes its frames.
class CameraWorker {
 public:
  CameraWorker(const CameraConfig& config, const CameraSection& section, CameraOpener opener);
  ~CameraWorker();
  CameraWorker(const CameraWorker&) = delete;
  CameraWorker& operator=(const CameraWorker&) = delete;

  /// Nothing if it is not connected or still at an earlier order; `frame` then says why.
  std::shared_ptr<FrameOrder> order(const std::shared_ptr<FrameOrder>& order, SetFrame& frame);
  CameraStatus status() const;
  bool connected() const;
  /// Puts what was wrong with the last frame into the status.
  void noteFault(FrameFault fault);

 private:
  void run();
  void open();
  void warmUp();
  void close(FrameFault why, const std::string& detail);
  SetFrame take(const FrameWish& wish);
  SetFrame await(const FrameWish& wish, SetFrame frame);
  void publish();

  const CameraConfig config_;
  const CameraSection& section_;
  CameraOpener opener_;

  std::unique_ptr<Camera> camera_;  ///< Of the thread, as the next ones.
  FrameJudge judge_;
  int silences_ = 0;  ///< Triggers in a row that it confirmed and sent nothing for.

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<FrameOrder> order_;
  bool busy_ = false, quitting_ = false;
  FrameFault absence_ = FrameFault::kNotConnected;
  CameraStatus status_;
  std::thread thread_;
};

}  // namespace tenter
