// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "recorder.h"
#include "tenter/acquisition/camera_bank.h"

namespace tenter::daemon {

/// The rig's cameras: takes the sets that a run asks for into its session, in a thread of its own,
/// and shows clients what the cameras see.
class CaptureService {
 public:
  explicit CaptureService(CameraSection section);
  ~CaptureService();
  CaptureService(const CaptureService&) = delete;
  CaptureService& operator=(const CaptureService&) = delete;

  bool any() const { return !bank_.section().cameras.empty(); }
  /// Waits until all cameras are open; error names the first that is not.
  Result<void> awaitAll(std::chrono::milliseconds timeout);
  /// A set for the session, the run's `index`th; does not wait. Where the one before has not begun
  /// yet, this one is left out, and the session says so.
  void request(std::int64_t index, const std::shared_ptr<Recorder>& recorder);
  /// For a client: the last set of the run that goes on, or one of now. Error: there are no
  /// cameras.
  Result<std::shared_ptr<const FrameSet>> look();
  const CameraSection& section() const { return bank_.section(); }
  nlohmann::json status() const;

 private:
  struct Wanted {
    std::int64_t index = 0;
    std::shared_ptr<Recorder> recorder;
    std::shared_ptr<void> expected;  ///< Keeps the session open.
  };
  void run();
  void record(const FrameSet& set, const Wanted& wanted);
  nlohmann::ordered_json recordOf(const FrameSet& set, const Wanted& wanted,
                                  const std::optional<std::int64_t>& frame) const;

  CameraBank bank_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Wanted> wanted_;
  bool quitting_ = false;
  std::weak_ptr<Recorder> running_;  ///< Of the set in `last_`.
  std::shared_ptr<const FrameSet> last_;
  std::thread thread_;
};

}  // namespace tenter::daemon
