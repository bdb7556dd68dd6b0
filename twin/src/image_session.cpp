// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/image_session.h"

#include <chrono>
#include <sstream>

#include "random_numbers.h"
#include "rig_noise.h"
#include "rig_setup.h"
#include "tenter/core/files.h"
#include "tenter/session/session_writer.h"
#include "tenter/twin/mounted_specimen.h"
#include "tenter/twin/rig_mounting.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::int64_t kFrameInterval_ns = 2'000'000'000;  // [Est12] sec. 3.1
constexpr double kMaxCalibrationError_px = 5.0;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Tensions by axis: of cords what their cells read, of the others the cells' noise.
std::vector<TensionReading> readingsOf(const Mounting& mounting, const MeasurementFrame* frame,
                                       const CaptureOptions& options, std::int64_t number) {
  RandomNumbers random(options.seed, "idle cells " + std::to_string(number));
  std::vector<TensionReading> readings;
  for (int i = 0; i < MountedSpecimen::kAxes; ++i) {
    const double noise_N = options.noise ? RigErrors::kCell_N * random.normal() : 0.0;
    readings.push_back({noise_N, TensionStatus::kOk, 0});
  }
  if (frame == nullptr) return readings;
  for (const MountedCord& cord : mounting.cords) {
    for (const CordReading& reading : frame->cords) {
      if (reading.cord != cord.cord) continue;
      readings.at(static_cast<std::size_t>(cord.cell)).tension_N = reading.tension_N;
    }
  }
  return readings;
}

std::string camerasToml(const std::vector<VirtualCamera>& cameras) {
  std::ostringstream toml;
  toml << "# SPDX-License-Identifier: CC0-1.0\nschema_version = 1\nname = \"virtual rig\"\n";
  for (const VirtualCamera& camera : cameras) {
    toml << "\n[[camera]]\nname = \"" << camera.name << "\"\nwidth_px = " << camera.model.widthPx()
         << "\nheight_px = " << camera.model.heightPx() << "\n";
  }
  return toml.str();
}

Result<void> checkCalibration(const CameraCalibration& calibration,
                              const std::vector<VirtualCamera>& cameras) {
  if (!calibration.rig) {
    return badInput("", "rig", "the calibration does not say where the rig is",
                    "calibrate with --rig-board");
  }
  for (const VirtualCamera& camera : cameras) {
    const CalibratedCamera* known = calibration.find(camera.name);
    if (known == nullptr) return badInput("", "cameras", "'" + camera.name + "' is not calibrated");
    if (known->model.widthPx() != camera.model.widthPx() ||
        known->model.heightPx() != camera.model.heightPx()) {
      return badInput("", "cameras", "'" + camera.name + "' was calibrated at another image size");
    }
  }
  return {};
}

class SessionRun {
 public:
  explicit SessionRun(const ImageSessionOptions& options) : o_(options) {}

  Result<ImageSessionSummary> run() {
    if (auto ready = prepare(); !ready) return ready.error();
    if (auto simulated = simulate(); !simulated) return simulated.error();
    if (auto opened = open(); !opened) return opened.error();
    const auto begin = Clock::now();
    const auto all = static_cast<std::int64_t>(result_->moments.size()) + 1;
    for (std::int64_t i = 0; i < all; ++i) {
      if (o_.capture.cancelled && o_.capture.cancelled()) {
        if (auto closed = writer_->close(i * kFrameInterval_ns); !closed) return closed.error();
        return notConverged("stopped after " + std::to_string(i) + " of " + std::to_string(all) +
                            " frames; the session holds these");
      }
      if (auto recorded = record(i); !recorded) return recorded.error();
      ++summary_.frames;
      tell(static_cast<double>(i + 1) / static_cast<double>(all),
           "frame " + std::to_string(i + 1) + " of " + std::to_string(all));
    }
    if (auto closed = writer_->close(all * kFrameInterval_ns); !closed) return closed.error();
    if (!o_.truth.empty()) {
      if (auto kept = writeTruth(o_.truth, result_->truth); !kept) return kept.error();
    }
    summary_.rendering_s = secondsSince(begin);
    return summary_;
  }

 private:
  void tell(double share, const std::string& what) const {
    if (o_.progress) o_.progress(share, what);
  }

  Result<void> prepare() {
    if (!(o_.calibration_error_px >= 0.0 && o_.calibration_error_px <= kMaxCalibrationError_px)) {
      return usageError("the calibration's error must be 0 to 5 pixels");
    }
    auto mounting = rigMounting(o_.capture.fabric, o_.capture.protocol);
    if (!mounting) return mounting.error();
    mounting_ = *std::move(mounting);
    mounting_.rest_frame = 0;
    RigCameraOptions which = o_.cameras;
    which.protocol = o_.capture.protocol;
    which.seed = o_.capture.seed;
    auto cameras = rigCameras(which);
    if (!cameras) return cameras.error();
    if (o_.calibration) {
      if (auto fits = checkCalibration(*o_.calibration, *cameras); !fits) return fits;
    }
    RenderOptions render = o_.render;
    render.seed = o_.capture.seed;
    auto renderer = SceneRenderer::make(mounting_, *std::move(cameras), render);
    if (!renderer) return renderer.error();
    renderer_ = *std::move(renderer);
    summary_.cameras = static_cast<int>(renderer_->cameras().size());
    summary_.feature_m = renderer_->featureSize_m();
    return {};
  }

  Result<void> simulate() {
    CaptureOptions capture = o_.capture;
    capture.keep_moments = true;
    capture.progress = [&](int done, int all) {
      tell(static_cast<double>(done) / std::max(all, 1), "simulating");
    };
    auto captured = captureMeasurement(capture);
    if (!captured) return captured.error();
    result_ = *std::move(captured);
    summary_.simulation_s = result_->statistics.seconds;
    result_->truth.cameras = calibrationOf(renderer_->cameras(), focus(), 0.0, o_.capture.seed);
    return {};
  }

  Vec3 focus() const { return rigFocus(o_.capture.protocol); }

  SessionHeader header(const std::string& mounting, const std::string& calibration) const {
    const Measurement& m = result_->measurement;
    SessionHeader h;
    h.id = m.name;
    h.who = "virtual rig";
    h.operator_name = "tenter twin capture";
    h.start_utc = o_.start_utc;
    h.fabric = m.fabric;
    h.specimen = m.specimen;
    h.areal_density_kg_per_m2 = m.areal_density_kg_per_m2;
    h.protocol = m.protocol;
    h.protocol_text = o_.protocol_text;
    h.rig_configuration = camerasToml(renderer_->cameras());
    h.calibration_ids = {{"cameras", sha256(calibration)}, {"mounting", sha256(mounting)}};
    for (int i = 0; i < MountedSpecimen::kAxes; ++i) {
      h.actuators.push_back(axisName(i));
      h.cells.push_back(cellName(i));
    }
    return h;
  }

  Result<void> open() {
    const auto mounting = mountingJson(mounting_);
    if (!mounting) return mounting.error();
    const std::string calibration =
        calibrationText(o_.calibration ? *o_.calibration
                                       : calibrationOf(renderer_->cameras(), focus(),
                                                       o_.calibration_error_px, o_.capture.seed));
    auto writer = SessionWriter::create(o_.session, header(*mounting, calibration));
    if (!writer) return writer.error();
    writer_ = *std::move(writer);
    const fs::path calibration_file = o_.session / kSessionCalibrationFile;
    std::error_code failed;
    fs::create_directories(calibration_file.parent_path(), failed);
    if (failed) return badInput(calibration_file.string(), "", failed.message());
    if (auto done = writeFileAtomically(o_.session / kMountingFile, *mounting); !done) return done;
    return writeFileAtomically(calibration_file, calibration);
  }

  /// Frame 0 is the sample at rest, before the actuators have moved.
  Result<void> record(std::int64_t number) {
    const bool rests = number == 0;
    const auto test = static_cast<std::size_t>(rests ? 0 : number - 1);
    const RigMoment& moment = result_->moments[test];
    const MeasurementFrame* readings = rests ? nullptr : &result_->measurement.frames[test];
    SampleRecord sample;
    for (const double position_m : moment.positions_m)
      sample.positions_m.emplace_back(rests ? 0.0 : position_m);
    sample.tensions = readingsOf(mounting_, readings, o_.capture, number);
    const std::int64_t time_ns = number * kFrameInterval_ns;
    if (auto done = writer_->append(time_ns, sample, Commit::kGroup); !done) return done.error();

    const std::vector<ByteImage> pictures =
        renderer_->render(rests ? flatSample() : moment.shape, static_cast<std::uint64_t>(number));
    std::vector<std::string> files;
    std::vector<FrameImage> images;
    files.reserve(pictures.size());
    for (std::size_t c = 0; c < pictures.size(); ++c) {
      const VirtualCamera& camera = renderer_->cameras()[c];
      files.push_back(encodePng(pictures[c], camera.model.lens().fx_px / camera.focus_m));
      images.push_back({camera.name, "png", files.back()});
    }
    auto added = writer_->addFrame(time_ns, images);
    return added ? Result<void>() : Result<void>(added.error());
  }

  const ImageSessionOptions& o_;
  Mounting mounting_;
  std::unique_ptr<SceneRenderer> renderer_;
  std::optional<CaptureResult> result_;
  std::unique_ptr<SessionWriter> writer_;
  ImageSessionSummary summary_;
};

}  // namespace

Result<ImageSessionSummary> captureImageSession(const ImageSessionOptions& options) {
  return SessionRun(options).run();
}

}  // namespace tenter
