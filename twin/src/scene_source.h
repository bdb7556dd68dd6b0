// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tbb/task_scheduler_observer.h>

#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>

#include "live_specimen.h"
#include "tenter/twin/image_source.h"
#include "tenter/twin/scene_renderer.h"
#include "tenter/twin/served_rig.h"

namespace tenter {

/// Renders what hangs in a served rig. The cameras of one set ask within a moment of each other,
/// and get pictures of one equilibrium.
class SceneSource : public ImageSource {
 public:
  using Look = std::function<std::shared_ptr<const LiveSpecimen::Still>()>;

  /// @param truth  file that gets a line for every rendering: the clock, and of which positions it
  /// is.
  SceneSource(std::unique_ptr<SceneRenderer> renderer, Look look,
              const std::filesystem::path& truth);

  void fill(const ImageRequest& request, std::span<std::uint8_t> pixels) override;

 private:
  using Clock = std::chrono::steady_clock;
  /// Of the ray tracer.
  class PatientWorkers : public tbb::task_scheduler_observer {
   public:
    ~PatientWorkers() override { observe(false); }
    void on_scheduler_entry(bool is_worker) override;
  };
  void render(Clock::time_point begin);

  std::unique_ptr<SceneRenderer> renderer_;
  Look look_;
  PatientWorkers patience_;
  std::ofstream truth_;
  std::mutex mutex_;
  std::vector<ByteImage> images_;
  std::vector<bool> taken_;  ///< By each camera, of images_.
  Clock::time_point begin_;  ///< Of the request that images_ were rendered for.
  std::uint64_t number_ = 0;
};

/// Virtual cameras that see `look()`; writes mounting.json and calibration.json into the rig's
/// state folder. Errors: the protocol hangs nothing on cords; those of the renderer.
Result<VirtualCamerasOptions> prepareScene(const ServedRigOptions& options, SceneSource::Look look);

}  // namespace tenter
