// SPDX-License-Identifier: GPL-3.0-or-later
#include "demo_images.h"

#include <algorithm>
#include <chrono>

#include "interrupt.h"
#include "progress.h"
#include "tenter/calib/calibrate_cameras.h"
#include "tenter/core/files.h"
#include "tenter/reconstruction/quality_report.h"
#include "tenter/reconstruction/reconstruct_session.h"
#include "tenter/session/session_header.h"
#include "tenter/session/session_reader.h"
#include "tenter/twin/board_images.h"
#include "tenter/twin/image_session.h"
#ifdef TENTER_HARDWARE
#include "protocol_files.h"
#include "twin_session.h"
#endif

namespace tenter::app {

namespace {

namespace fs = std::filesystem;

constexpr int kCameras = 4;
constexpr double kMaxRms_px = 0.5;

/// What an earlier demo left in its folder.
void startAnew(const fs::path& folder) {
  std::error_code ignored;
  fs::remove_all(folder, ignored);
}

RigCameraOptions camerasOf(const DemoCameras& demo, const std::string& protocol) {
  return {protocol, kCameras, demo.width_px, demo.seed};
}

RenderOptions renderOf(const DemoCameras& demo) {
  RenderOptions render;
  render.seed = demo.seed;
  render.texture_seed = static_cast<unsigned>(demo.seed);
  return render;
}

Result<CameraCalibration> calibrate(const DemoCameras& demo, const std::string& protocol,
                                    const fs::path& folder, Progress& progress) {
  BoardImageOptions boards;
  boards.boards = demo.boards;
  boards.cameras = camerasOf(demo, protocol);
  boards.render = renderOf(demo);
  boards.folder = folder / "boards";
  boards.cancelled = interrupted;
  boards.progress = [&](double share, const std::string& what) {
    progress.show(share, protocol + ", " + what);
  };
  if (auto done = writeBoardImages(boards); !done) return done.error();
  std::vector<CameraSource> sources;
  for (int i = 1; i <= kCameras; ++i) {
    const std::string name = "cam-" + std::to_string(i);
    sources.push_back({name, name});
  }
  const auto photos =
      gatherPhotos((boards.folder / "{camera}-{index:06}.png").string(), sources, virtualBoard(),
                   [&](double share, const std::string& name) {
                     progress.show(share, protocol + ", looking for the board in " + name);
                     return !interrupted();
                   });
  if (!photos) return photos.error();
  CameraCalibrationOptions options;
  options.max_rms_px = kMaxRms_px;
  options.rig_index = 0;
  auto calibration = calibrateCameras(virtualBoard(), *photos, options);
  if (!calibration) return calibration.error();
  if (auto done = writeCalibration(folder / "calibration.json", *calibration); !done) {
    return done.error();
  }
  if (!calibration->accepted) {
    return Error{ErrorKind::kCalibrationRejected, (folder / "calibration.json").string(), "",
                 calibration->reasons.empty() ? "rejected" : calibration->reasons.front(), ""};
  }
  return calibration;
}

/// The session's measurement; its page on quality is left in the folder.
Result<SeenTest> reconstruct(const DemoCameras& demo, const fs::path& folder,
                             const std::string& name, Progress& progress) {
  const auto session = openImageSession(folder / "session");
  if (!session) return session.error();
  SessionReconstruction options;
  options.surface.correlate.match.subset_px = demo.subset_px;
  options.surface.correlate.threads = demo.threads;
  options.keep_going = [&](int done, int count) {
    progress.show(static_cast<double>(done) / count, name + ", reconstructing");
    return !interrupted();
  };
  auto result = reconstructSession(*session, options);
  if (!result) return result.error();
  if (result->stopped) return notConverged("stopped by the user");
  const auto image = [&](std::size_t frame) {
    return pictureOf(*session, result->quality[frame].number);
  };
  const std::string page = qualityReport(*result, session->views.front(), image);
  if (auto done = writeFileAtomically(folder / "quality.html", page); !done) return done.error();
  double valid = 0.0, seconds = 0.0, sigma_m = 0.0;
  for (const FrameQuality& frame : result->quality) {
    valid += static_cast<double>(frame.valid);
    seconds += frame.seconds;
    sigma_m = std::max(sigma_m, frame.sigma_median_m);
  }
  const auto count = static_cast<double>(result->quality.size());
  char text[200];
  std::snprintf(text, sizeof text,
                "%s: %zu frames from images, %.1f %% of %d vertices valid, median sigma below "
                "%.4f mm, %.1f s a frame",
                name.c_str(), result->quality.size(),
                100.0 * valid / (count * result->measurement.rest->vertexCount()),
                result->measurement.rest->vertexCount(), 1e3 * sigma_m, seconds / count);
  SeenTest seen{std::move(result->measurement), text};
  seen.measurement.name = name;
  return seen;
}

}  // namespace

Result<SeenTest> measureByImages(const DemoCameras& demo, const ProtocolInfo& protocol,
                                 Console& console) {
  const std::string name(protocol.id);
  const fs::path folder = demo.folder / name;
  startAnew(folder);
  Progress progress(console);
  auto calibration = calibrate(demo, name, folder, progress);
  if (!calibration) return calibration.error();
  std::string calibrated = "; the cameras' calibration was not tried on held-out boards";
  if (const auto held_out_px = calibration->quality.held_out_rms_px) {
    char text[80];
    std::snprintf(text, sizeof text, "; cameras calibrated to %.3f px on held-out boards",
                  *held_out_px);
    calibrated = text;
  }
  ImageSessionOptions session;
  session.capture.fabric = demo.fabric;
  session.capture.protocol = name;
  session.capture.seed = demo.seed;
  session.capture.nodes = demo.nodes;
  session.capture.frames = demo.frames;
  session.capture.cancelled = interrupted;
  session.cameras = camerasOf(demo, name);
  session.render = renderOf(demo);
  session.calibration = *std::move(calibration);
#ifdef TENTER_HARDWARE
  const auto text = protocolText(name);
  if (!text) return text.error();
  session.protocol_text = *text;
#endif
  session.start_utc = utcStamp(std::chrono::system_clock::now());
  session.session = folder / "session";
  session.progress = [&](double share, const std::string& what) {
    progress.show(share, name + ", " + what);
  };
  if (const auto done = captureImageSession(session); !done) return done.error();
  auto seen = reconstruct(demo, folder, name, progress);
  if (seen) seen->summary += calibrated;
  return seen;
}

#ifdef TENTER_HARDWARE

namespace {

constexpr const char* kOneCycle = R"(schema_version = 1
name = "stretch-weft"
description = "two bar clips pull along the weft, once"
axes = ["axis-1", "axis-2", "axis-3", "axis-4"]
speed_m_per_s = 0.0009
capture_interval_s = 4.0
[[phase]]
name = "pretension"
[[phase.step]]
end = "force"
force_N = 0.2
limit_m = 0.03
[[phase]]
name = "cycle"
[[phase.step]]
end = "force"
force_N = 1.0
limit_m = 0.05
[[phase.step]]
end = "force"
force_N = 0.2
limit_m = 0.05
)";

}  // namespace

Result<SeenTest> measureThroughDaemon(const DemoCameras& demo, Console& console) {
  const std::string name = "stretch-weft-live";
  const fs::path folder = demo.folder / name;
  startAnew(folder);
  SessionCapture capture;
  capture.mount.fabric = demo.fabric;
  capture.mount.protocol = "stretch-weft";
  capture.mount.seed = demo.seed;
  capture.cameras.cameras = kCameras;
  capture.cameras.images = CameraSourceOptions::kScene;
  capture.cameras.width_px = demo.width_px / 2;  // drawn while devices answer
  capture.protocol_text = kOneCycle;
  capture.output = (folder / "session").string();
  Console quiet = console;
  quiet.json = true;
  quiet.answer = nlohmann::json::object();
  const auto ended = captureSession(capture, quiet);
  if (!ended) return ended.error();
  if (*ended != kDone) {
    return Error{ErrorKind::kHardware, "tenterd", "",
                 "the run ended with " + std::to_string(*ended), quiet.answer.value("reason", "")};
  }
  const auto verified = verifySession(folder / "session");
  if (!verified) return verified.error();
  if (!verified->ok()) {
    return badInput(capture.output, "", "the session is not whole: " + verified->problems.front());
  }
  Progress progress(console);
  auto seen = reconstruct(demo, folder, name, progress);
  if (seen) seen->summary += "; the cameras' calibration is the virtual rig's, 0.02 px off";
  return seen;
}

#else

Result<SeenTest> measureThroughDaemon(const DemoCameras& /*demo*/, Console& /*console*/) {
  return Error{ErrorKind::kHardware, "tenterd", "", "this program was built without devices"};
}

#endif

}  // namespace tenter::app
