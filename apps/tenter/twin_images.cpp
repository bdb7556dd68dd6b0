// SPDX-License-Identifier: GPL-3.0-or-later
#include "twin_images.h"

#include <chrono>
#include <filesystem>

#include "interrupt.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/session/session_header.h"
#include "tenter/twin/board_images.h"
#include "tenter/twin/image_session.h"
#ifdef TENTER_HARDWARE
#include "protocol_files.h"
#endif

namespace tenter::app {

namespace {

namespace fs = std::filesystem;

RigCameraOptions camerasOf(const CaptureOptions& capture, const ImageOptions& o) {
  return {capture.protocol, o.cameras, o.width_px, capture.seed};
}

RenderOptions renderOf(const CaptureOptions& capture, const ImageOptions& o) {
  RenderOptions render;
  render.samples = o.rays;
  render.noise = capture.noise;
  render.seed = capture.seed;
  render.texture_seed =
      static_cast<unsigned>(capture.specimen != 0 ? capture.specimen : capture.seed);
  render.feature_m = 1e-3 * o.feature_mm;
  render.facets = 3 * (capture.tracked - 1);
  return render;
}

Result<void> checkTruthFolder(const std::string& truth, const std::string& output) {
  if (truth.empty()) return {};
  std::error_code failed;
  const fs::path way =
      fs::weakly_canonical(truth, failed).lexically_relative(fs::weakly_canonical(output, failed));
  if (!way.empty() && *way.begin() != "..") {
    return usageError("--truth must be a folder beside -o, not in it");
  }
  return checkOutputFolder(truth, truthFolder());
}

}  // namespace

void declareImages(CLI::App& command, ImageOptions& o) {
  command.add_option("--cameras", o.cameras, "Virtual cameras, 2 to 8")->capture_default_str();
  command
      .add_option("--image-width", o.width_px,
                  "Width of their images in pixels, 320 to 4096; 1936 x 1216 is 2.4 megapixels")
      ->capture_default_str();
  command.add_option("--rays", o.rays, "Rays a pixel, per side, 1 to 8")->capture_default_str();
  command
      .add_option("--feature-mm", o.feature_mm,
                  "Finest dots of the cloth's texture are one to two of it; 0: four pixels")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  command
      .add_option("--calibration-error-px", o.calibration_error_px,
                  "How far the session's calibration of the cameras is off")
      ->capture_default_str();
  command.add_option("--calibration", o.calibration,
                     "A calibration for the session to carry instead, such as one from --boards");
}

Result<int> captureImages(const CaptureOptions& capture, const ImageOptions& images,
                          const std::string& output, const std::string& truth, Console& console) {
  if (auto free = checkNewFolder(output); !free) return free.error();
  if (auto free = checkTruthFolder(truth, output); !free) return free.error();
  ImageSessionOptions options;
  options.capture = capture;
  options.cameras = camerasOf(capture, images);
  options.render = renderOf(capture, images);
  options.calibration_error_px = images.calibration_error_px;
  if (!images.calibration.empty()) {
    auto calibration = readCalibration(images.calibration);
    if (!calibration) return calibration.error();
    options.calibration = *std::move(calibration);
  }
#ifdef TENTER_HARDWARE
  const auto protocol = protocolText(capture.protocol);
  if (!protocol) return protocol.error();
  options.protocol_text = *protocol;
#endif
  options.start_utc = utcStamp(std::chrono::system_clock::now());
  options.session = output;
  options.truth = truth;
  Progress progress(console);
  options.progress = [&](double share, const std::string& what) {
    progress.show(share, capture.protocol + ", " + what);
  };
  const auto summary = captureImageSession(options);
  if (!summary) return summary.error();
  console.answer = {{"session", output},
                    {"fabric", capture.fabric},
                    {"protocol", capture.protocol},
                    {"frames", summary->frames},
                    {"cameras", summary->cameras},
                    {"feature_m", summary->feature_m},
                    {"simulation_s", summary->simulation_s},
                    {"rendering_s", summary->rendering_s},
                    {"seconds_per_frame", summary->rendering_s / summary->frames}};
  console.say(output + ": " + counted(static_cast<std::size_t>(summary->frames), "frame") + " of " +
              capture.protocol + " by " + std::to_string(summary->cameras) + " cameras");
  return kDone;
}

Result<int> captureBoards(const CaptureOptions& capture, const ImageOptions& images,
                          const std::string& output, const std::string& truth, Console& console) {
  if (auto free = checkOutputFolder(output, boardImageFolder()); !free) return free.error();
  if (auto free = checkTruthFolder(truth, output); !free) return free.error();
  BoardImageOptions options;
  options.boards = images.boards;
  options.cameras = camerasOf(capture, images);
  options.render = renderOf(capture, images);
  options.folder = output;
  options.truth = truth;
  options.cancelled = interrupted;
  Progress progress(console);
  options.progress = [&](double share, const std::string& what) { progress.show(share, what); };
  if (auto done = writeBoardImages(options); !done) return done.error();
  const Board board = virtualBoard();
  char text[160];
  std::snprintf(text, sizeof text,
                "tenter calibrate cameras --board charuco --corners %dx%d --square-mm %g "
                "--marker-mm %g --dictionary %s",
                board.columns, board.rows, 1e3 * board.square_m, 1e3 * board.marker_m,
                board.dictionary.c_str());
  std::string calibrate = text;
  for (int i = 1; i <= images.cameras; ++i) calibrate += " --camera cam-" + std::to_string(i);
  calibrate += " --images '" + output + "/{camera}-{index:06}.png' --rig-board 0 -o cal.json";
  console.answer = {{"boards", images.boards},
                    {"cameras", images.cameras},
                    {"folder", output},
                    {"calibrate", calibrate}};
  console.say(calibrate);
  return kDone;
}

}  // namespace tenter::app
