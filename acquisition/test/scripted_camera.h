// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "tenter/acquisition/camera_bank.h"

namespace tenter {

/// What one camera of a test does, set up by the test and looked at by the camera's thread.
struct CameraScript {
  std::mutex mutex;
  std::deque<FrameOutcome> waiting;  ///< Frames that have arrived.
  std::string serial = "S";
  bool answers = true;                 ///< Confirms triggers.
  bool there = true;                   ///< Can be opened.
  bool mute = false;                   ///< No frames until it is opened anew.
  int swallowed = 0;                   ///< Triggers without a frame, from now on.
  int torn = 0;                        ///< Triggers whose frame is not whole.
  int delayed = 0;                     ///< Triggers whose frame comes with the next one's.
  std::uint8_t grey = 100;             ///< Of the frame's pixels, on top of its texture.
  bool same = false;                   ///< One image for ever.
  int blur = 0;                        ///< Pixels over which the texture stays the same, less one.
  bool same_id = false;                ///< One frame number for ever.
  std::chrono::milliseconds hangs{0};  ///< How long a trigger takes.
  std::uint64_t frames = 0;
  std::deque<FrameOutcome> late;
};

class ScriptedCamera : public Camera {
 public:
  explicit ScriptedCamera(std::shared_ptr<CameraScript> script) : script_(std::move(script)) {
    identity_.serial = script_->serial;
    identity_.address = "here";
  }
  const CameraIdentity& identity() const override { return identity_; }

  Result<void> trigger() override {
    std::unique_lock lock(script_->mutex);
    if (const auto hangs = script_->hangs; hangs.count() > 0) {
      lock.unlock();
      std::this_thread::sleep_for(hangs);
      lock.lock();
    }
    if (!script_->answers) {
      return Error{ErrorKind::kHardware, "", "scripted", "does not take the trigger", ""};
    }
    while (!script_->late.empty()) {
      script_->waiting.push_back(script_->late.front());
      script_->late.pop_front();
    }
    if (script_->mute) return {};
    if (script_->swallowed > 0) {
      --script_->swallowed;
      return {};
    }
    FrameOutcome frame = make();
    if (script_->torn > 0) {
      --script_->torn;
      frame = {FrameFault::kLostPackets, "torn", {}};
    }
    auto& queue = script_->delayed > 0 ? script_->late : script_->waiting;
    if (script_->delayed > 0) --script_->delayed;
    queue.push_back(std::move(frame));
    return {};
  }

  FrameOutcome next(std::chrono::milliseconds timeout) override {
    const auto until = std::chrono::steady_clock::now() + timeout;
    do {
      {
        const std::lock_guard lock(script_->mutex);
        if (!script_->waiting.empty()) {
          FrameOutcome frame = std::move(script_->waiting.front());
          script_->waiting.pop_front();
          return frame;
        }
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    } while (std::chrono::steady_clock::now() < until);
    return {};
  }

  void drain() override {
    const std::lock_guard lock(script_->mutex);
    script_->waiting.clear();
  }
  CameraCounters counters() const override { return {script_->frames, 0, 0, 0, 0}; }
  bool gone() const override {
    const std::lock_guard lock(script_->mutex);
    return !script_->there;
  }

 private:
  FrameOutcome make() {
    constexpr int kSide_px = 32;
    FrameOutcome frame;
    frame.fault = FrameFault::kNone;
    frame.image.width_px = frame.image.height_px = kSide_px;
    const std::uint64_t number = ++script_->frames;
    frame.image.frame_id = script_->same_id ? 1 : number;
    frame.image.camera_ns = steadyNow_ns() + kClockAhead_ns;
    for (int y = 0; y < kSide_px; ++y) {
      for (int x = 0; x < kSide_px; ++x) {
        const auto cell = static_cast<std::uint64_t>((x / (script_->blur + 1)) * 131 +
                                                     (y / (script_->blur + 1)) * 517);
        const std::uint64_t seed = (script_->same ? 0 : number * 7) + cell;
        const auto texture = static_cast<int>((seed * 2654435761U >> 8) % 50);
        frame.image.pixels.push_back(
            static_cast<std::uint8_t>(std::min(255, script_->grey + texture)));
      }
    }
    return frame;
  }

  static constexpr std::int64_t kClockAhead_ns = 123'456'789'000;  // its own clock
  std::shared_ptr<CameraScript> script_;
  CameraIdentity identity_;
};

/// Cameras "a", "b" and so on, each with its script.
struct ScriptedCameras {
  explicit ScriptedCameras(int count) {
    for (int i = 0; i < count; ++i) {
      CameraConfig camera;
      camera.name = std::string(1, static_cast<char>('a' + i));
      camera.address = "address-" + camera.name;
      camera.serial = "S" + camera.name;
      scripts[camera.name] = std::make_shared<CameraScript>();
      scripts[camera.name]->serial = camera.serial;
      section.cameras.push_back(camera);
    }
    section.set_timeout = std::chrono::milliseconds(100);
  }
  CameraOpener opener() const {
    return [scripts = scripts](const CameraConfig& config,
                               const CameraSection&) -> Result<std::unique_ptr<Camera>> {
      const auto& script = scripts.at(config.name);
      const std::lock_guard lock(script->mutex);
      script->mute = false;
      if (script->there) return std::unique_ptr<Camera>(std::make_unique<ScriptedCamera>(script));
      return Error{ErrorKind::kHardware, "", config.name, "cannot be opened", ""};
    };
  }
  /// Changes what a camera does from now on.
  void set(const std::string& name, const std::function<void(CameraScript&)>& change) {
    const std::lock_guard lock(scripts.at(name)->mutex);
    change(*scripts.at(name));
  }
  CameraSection section;
  std::map<std::string, std::shared_ptr<CameraScript>> scripts;
};

}  // namespace tenter
