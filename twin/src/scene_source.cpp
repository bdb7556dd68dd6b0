// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene_source.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include "tenter/core/files.h"
#include "tenter/twin/rig_mounting.h"
#include "yield_to_others.h"

namespace tenter {
namespace {

using namespace std::chrono_literals;

/// Between the triggers of one set; sets come further apart.
constexpr auto kOneMoment = 150ms;
/// A set of full size on a machine with other work.
constexpr std::chrono::milliseconds kSetTimeout{10'000};

}  // namespace

void SceneSource::PatientWorkers::on_scheduler_entry(bool is_worker) {
  if (is_worker) yieldToOthers(kPicturesNice);
}

SceneSource::SceneSource(std::unique_ptr<SceneRenderer> renderer, Look look,
                         const std::filesystem::path& truth)
    : renderer_(std::move(renderer)), look_(std::move(look)), truth_(truth) {
  patience_.observe(true);
}

void SceneSource::fill(const ImageRequest& request, std::span<std::uint8_t> pixels) {
  const auto asked = Clock::now();
  const auto camera = static_cast<std::size_t>(request.camera);
  const std::lock_guard lock(mutex_);
  const bool of_now = camera < taken_.size() && !taken_[camera] && asked - begin_ < kOneMoment;
  if (!of_now) render(asked);
  std::fill(pixels.begin(), pixels.end(), std::uint8_t{0});
  if (camera >= images_.size()) return;
  taken_[camera] = true;
  const ByteImage& image = images_[camera];
  const int rows = std::min(image.height, request.height_px);
  const int columns = std::min(image.width, request.width_px);
  for (int row = 0; row < rows; ++row) {
    const auto from = image.pixels.begin() + static_cast<std::ptrdiff_t>(row) * image.width;
    std::copy(from, from + columns,
              pixels.begin() + static_cast<std::ptrdiff_t>(row) * request.width_px);
  }
  expose(pixels, request.exposure_us, request.gain_dB);
}

void SceneSource::render(Clock::time_point begin) {
  begin_ = begin;
  const auto still = look_();
  std::jthread([&] {
    yieldToOthers(kPicturesNice);
    images_ = renderer_->render(still->shape, number_);
  }).join();
  taken_.assign(images_.size(), false);
  const auto now = Clock::now().time_since_epoch();
  truth_ << nlohmann::json{{"number", number_},
                           {"monotonic_ns",
                            std::chrono::nanoseconds(begin.time_since_epoch()).count()},
                           {"rendering_ns",
                            std::chrono::nanoseconds(now - begin.time_since_epoch()).count()},
                           {"positions_m", still->at_m}}
                .dump()
         << std::endl;
  ++number_;
}

Result<VirtualCamerasOptions> prepareScene(const ServedRigOptions& options,
                                           SceneSource::Look look) {
  if (!look()) {
    return usageError("cameras cannot look at \"" + options.mount.protocol + "\"",
                      "nothing hangs on cords there");
  }
  auto mounting = rigMounting(options.mount.fabric, options.mount.protocol);
  if (!mounting) return mounting.error();
  RigCameraOptions which = options.scene->cameras;
  which.protocol = options.mount.protocol;
  which.seed = options.mount.seed;
  auto cameras = rigCameras(which);
  if (!cameras) return cameras.error();
  const auto text = mountingJson(*mounting);
  if (!text) return text.error();
  const std::string calibration = calibrationText(calibrationOf(
      *cameras, rigFocus(which.protocol), options.scene->calibration_error_px, which.seed));
  for (const auto& [name, content] :
       {std::pair("mounting.json", *text), std::pair("calibration.json", calibration)}) {
    if (auto done = writeFileAtomically(options.state / name, content); !done) return done.error();
  }
  VirtualCamerasOptions out;
  out.count = static_cast<int>(cameras->size());
  out.width_px = cameras->front().model.widthPx();
  out.height_px = cameras->front().model.heightPx();
  out.seed = options.mount.seed;
  out.set_timeout = kSetTimeout;
  RenderOptions render = options.scene->render;
  render.seed = options.mount.seed;
  render.texture_seed = static_cast<unsigned>(options.mount.specimen != 0 ? options.mount.specimen
                                                                          : options.mount.seed);
  auto renderer = SceneRenderer::make(*std::move(mounting), *std::move(cameras), render);
  if (!renderer) return renderer.error();
  out.source = std::make_shared<SceneSource>(*std::move(renderer), std::move(look),
                                             options.state / "images.jsonl");
  return out;
}

}  // namespace tenter
