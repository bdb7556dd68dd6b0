// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tenter/acquisition/camera.h"
#include "tenter/acquisition/frame_quality.h"

namespace tenter {

/// One camera's part of a set.
struct SetFrame {
  FrameFault fault = FrameFault::kNone;
  std::string detail;
  CameraImage image;  ///< Without pixels if isLost(fault).
  FrameQuality quality;
  std::int64_t trigger_ns = 0;    ///< Before the trigger was sent.
  std::int64_t confirmed_ns = 0;  ///< When the camera had confirmed it.
};

/// A frame that was lost, or is doubtful, while a set was taken.
struct SetEvent {
  int camera = 0;
  int attempt = 0;  ///< From 0; the last one's frames are those of the set.
  FrameFault fault = FrameFault::kNone;
  std::string detail;
};

/// Frames of one moment, one a camera in the order of the configuration. Times are CLOCK_MONOTONIC.
struct FrameSet {
  std::int64_t number = 0;   ///< Counts what the bank took, from 0.
  std::int64_t time_ns = 0;  ///< Of the first trigger.
  std::int64_t done_ns = 0;
  int retakes = 0;
  std::vector<SetFrame> frames;
  std::vector<SetEvent> events;
  /// By the cameras' clocks, if they have one in common; else between the first trigger sent and
  /// the last one confirmed, so that no two exposures began further apart.
  std::optional<std::int64_t> skew_ns;

  bool complete() const;  ///< Every camera gave an image.
};

struct CameraStatus {
  std::string name;
  bool connected = false;
  std::string fault;  ///< Why not, or what was wrong with its last frame; empty if all is well.
  CameraIdentity identity;
  CameraCounters counters;
};

/// CLOCK_MONOTONIC.
std::int64_t steadyNow_ns();

class CameraWorker;

/// All cameras of a rig. Each has a thread of its own that opens it, opens it again when it was
/// gone, and takes its frames; so one that hangs keeps no other waiting.
class CameraBank {
 public:
  /// Does not wait for the cameras: those that are missing are looked for every second.
  explicit CameraBank(CameraSection section, CameraOpener opener = openAravisCamera);
  ~CameraBank();
  CameraBank(const CameraBank&) = delete;
  CameraBank& operator=(const CameraBank&) = delete;

  /// Until all cameras are open, or the time is over; whether they are.
  bool awaitAll(std::chrono::milliseconds timeout);
  /// Takes one set, again as often as the section allows while a frame is lost. Lasts at most
  /// (1 + retakes) times the set's time-out and a little. From one thread at a time: others wait.
  FrameSet takeSet();
  std::vector<CameraStatus> status() const;
  const CameraSection& section() const { return section_; }

 private:
  void attempt(FrameSet& set, int attempt);
  void pair(FrameSet& set);

  CameraSection section_;
  std::vector<std::unique_ptr<CameraWorker>> workers_;
  std::mutex taking_;
  std::int64_t sets_ = 0;
};

}  // namespace tenter
