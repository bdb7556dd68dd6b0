// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/reconstruct_session.h"

#include <algorithm>
#include <chrono>
#include <sstream>

#include "partial_store.h"
#include "rig_reader.h"
#include "subset_centres.h"
#include "tenter/session/rest_pictures.h"

namespace tenter {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

std::size_t imagesIn(const std::vector<GrayImage>& images) {
  return static_cast<std::size_t>(std::count_if(
      images.begin(), images.end(), [](const GrayImage& image) { return image.width > 0; }));
}

/// What finished frames depend on.
/// Goes up when frames come out otherwise than before: what an older program kept is done again.
constexpr int kMethod = 4;

std::string identityOf(const ImageSession& session, const SessionReconstruction& o) {
  const CorrelateOptions& c = o.surface.correlate;
  std::ostringstream text;
  text.precision(17);
  text << kMethod << '\n'
       << session.identity << '\n'
       << c.match.subset_px << ' ' << c.match.order << ' ' << c.min_zncc << ' ' << c.max_sigma_px
       << ' ' << o.surface.max_residual_px << ' ' << o.surface.vertices_per_side << ' '
       << o.tension.cell_N << ' ' << o.tension.friction_N;
  return text.str();
}

class SessionRun {
 public:
  SessionRun(const ImageSession& session, const SessionReconstruction& options)
      : s_(session), o_(options), store_(options.partial, identityOf(session, options)) {}

  Result<SeriesResult> run() {
    if (auto ready = atRest(); !ready) return ready.error();
    for (std::size_t i = 0; i < s_.moments.size(); ++i) {
      // A frame at rest lies before the test and is none of its frames.
      if (s_.at_rest && i <= s_.reference) continue;
      if (!going()) {
        result_.stopped = true;
        break;
      }
      if (auto done = frame(i); !done) return done.error();
    }
    if (result_.measurement.frames.empty()) {
      return badInput(s_.folder.string(), "frames", "there is no frame after the one at rest");
    }
    return std::move(result_);
  }

 private:
  bool going() const {
    const int count = static_cast<int>(s_.moments.size());
    return !o_.keep_going || o_.keep_going(static_cast<int>(result_.quality.size()), count);
  }

  SheetGrid grid() const {
    const Mounting& m = s_.mounting;
    SheetGrid grid;
    grid.origin_m = m.sample_corner_m;
    const double spacing = m.sample_size_m.maxCoeff() / (o_.surface.vertices_per_side - 1);
    const Vec2 cells = (m.sample_size_m / spacing).array().round().max(2.0);
    grid.columns = static_cast<int>(cells.x()) + 1;
    grid.rows = static_cast<int>(cells.y()) + 1;
    grid.spacing_m = m.sample_size_m.cwiseQuotient(cells);
    grid.to_the_edge = true;
    grid.free = [this](const Vec2& place) { return onCloth(place); };
    const Mat2 turn = Eigen::Rotation2Dd(m.thread_angle_rad).toRotationMatrix();
    grid.uv = [turn, corner = m.sample_corner_m](const Vec2& place) -> Vec2 {
      return turn * (place - corner);
    };
    return grid;
  }

  bool onCloth(const Vec2& place) const {
    const Vec2 at = place - s_.mounting.sample_corner_m;
    return (at.array() >= 0.0).all() && (at.array() <= s_.mounting.sample_size_m.array()).all();
  }

  Result<void> atRest() {
    const SessionMoment& moment = s_.moments[s_.reference];
    std::vector<std::string> warnings;
    const std::vector<GrayImage> images = readMoment(s_, moment, warnings);
    const std::string name = "frame " + std::to_string(moment.frame);
    for (const std::string& warning : warnings) result_.warnings.push_back(name + ": " + warning);
    if (imagesIn(images) < 2) {
      return badInput(s_.folder.string(), name,
                      "the reference has fewer than two images" +
                          (warnings.empty() ? std::string() : ": " + warnings.front()));
    }
    options_ = o_.surface;
    options_.correlate.keep_going = [this](double) { return going(); };
    auto rest = findSheet(s_.views, images, options_, grid());
    if (!rest) {
      Error error = rest.error().in(s_.folder.string());
      error.place = name;
      if (!s_.at_rest) {
        error.advice = "pictures of the sample as it lies flat before it is hung are missing: " +
                       std::string(kRestFolder) + "/CAMERA.png in the session, or rest_frame in " +
                       kMountingFile;
      }
      return error;
    }
    result_.rest = std::move(*rest);
    addSystematicError(&s_.calibration, s_.views, result_.rest);
    result_.warnings.insert(result_.warnings.end(), result_.rest.warnings.begin(),
                            result_.rest.warnings.end());
    RestSurface followed = result_.rest;
    avoidClips(
        s_.views, s_.mounting.clips, options_.correlate.match.subset_px,
        [this](const Vec2& place) { return onCloth(place); }, followed);
    auto tracker = ClothTracker::create(s_.views, images, followed, options_);
    if (!tracker) return tracker.error();
    tracker_.emplace(std::move(*tracker));
    rig_.emplace(s_, result_.rest, o_.tension);
    fillHeader();
    return {};
  }

  void fillHeader() {
    Measurement& m = result_.measurement;
    m.name = s_.header.id;
    m.fabric = s_.header.fabric;
    m.specimen = s_.header.specimen;
    m.protocol = s_.header.protocol;
    m.areal_density_kg_per_m2 = s_.mounting.areal_density_kg_per_m2;
    m.thickness_m = s_.mounting.thickness_m;
    m.sample_size_m = s_.mounting.sample_size_m;
    m.gravity_m_per_s2 = s_.mounting.gravity_m_per_s2;
    for (const MountedClip& clip : s_.mounting.clips) {
      m.clips.push_back({clip.id, clip.mass_kg, clip.shape});
    }
    m.rest = result_.rest.mesh;
  }

  Result<void> frame(std::size_t index) {
    const SessionMoment& moment = s_.moments[index];
    const auto vertices = static_cast<std::size_t>(result_.rest.mesh.vertexCount());
    if (auto done = store_.load(moment.frame, vertices)) {
      last_stored_ = index;
      last_cloth_ = done->cloth;
      keep(std::move(*done), moment);
      return {};
    }
    std::vector<std::string> warnings;
    if (last_stored_) {
      const std::vector<GrayImage> before = readMoment(s_, s_.moments[*last_stored_], warnings);
      tracker_->goOnFrom(last_cloth_, before);
      last_stored_.reset();
      warnings.clear();
    }
    const Clock::time_point begin = Clock::now();
    const std::vector<GrayImage> images = readMoment(s_, moment, warnings);
    auto reading = rig_->read(images, moment);
    if (!reading) return reading.error().in((s_.folder / kMountingFile).string());
    auto cloth = tracker_->track(images, reading->held);
    if (!cloth) return cloth.error().in(s_.folder.string());
    rig_->addTable(*cloth, *reading);
    FinishedFrame finished;
    finished.frame.time_ns = moment.time_ns;
    finished.frame.branch =
        rig_->branchBetween(index > 0 ? &s_.moments[index - 1] : nullptr, moment);
    finished.frame.clips = std::move(reading->clips);
    finished.frame.cords = std::move(reading->cords);
    finished.cloth = std::move(*cloth);
    auto& said = finished.cloth.warnings;
    said.insert(said.begin(), warnings.begin(), warnings.end());
    said.insert(said.end(), reading->warnings.begin(), reading->warnings.end());
    finished.clip_position_sigma_m = reading->clip_position_sigma_m;
    finished.clip_rotation_sigma_rad = reading->clip_rotation_sigma_rad;
    finished.seconds = secondsSince(begin);
    if (auto kept = store_.save(moment.frame, finished); !kept) return kept;
    keep(std::move(finished), moment);
    return {};
  }

  void keep(FinishedFrame finished, const SessionMoment& moment) {
    MeasurementFrame frame = measuredFrame(finished.cloth, moment.time_ns);
    frame.branch = finished.frame.branch;
    frame.clips = std::move(finished.frame.clips);
    frame.cords = std::move(finished.frame.cords);
    Measurement& m = result_.measurement;
    m.clip_position_sigma_m = std::max(m.clip_position_sigma_m, finished.clip_position_sigma_m);
    m.clip_rotation_sigma_rad =
        std::max(m.clip_rotation_sigma_rad, finished.clip_rotation_sigma_rad);
    FrameQuality quality = qualityOf(finished.cloth);
    quality.number = static_cast<int>(moment.frame);
    quality.time_ns = moment.time_ns;
    quality.seconds = finished.seconds;
    m.frames.push_back(std::move(frame));
    result_.quality.push_back(std::move(quality));
    result_.maps.add(finished.cloth);
  }

  const ImageSession& s_;
  const SessionReconstruction& o_;
  SurfaceOptions options_;
  SeriesResult result_;
  std::optional<ClothTracker> tracker_;
  std::optional<RigReader> rig_;
  PartialStore store_;
  std::optional<std::size_t> last_stored_;  ///< Frame that was not tracked but read.
  ClothFrame last_cloth_;
};

}  // namespace

Result<SeriesResult> reconstructSession(const ImageSession& session,
                                        const SessionReconstruction& options) {
  return SessionRun(session, options).run();
}

void discardPartial(const std::filesystem::path& folder) { PartialStore(folder, "").clear(); }

}  // namespace tenter
