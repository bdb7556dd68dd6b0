// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>
#include <thread>

#include "interrupt.h"
#include "output_guard.h"
#include "progress.h"
#include "tenter/calib/image_sequence.h"
#include "tenter/core/files.h"
#include "tenter/core/measurement_folder.h"
#include "tenter/reconstruction/quality_report.h"
#include "tenter/reconstruction/reconstruct_images.h"
#include "tenter/reconstruction/reconstruct_session.h"
#include "verbs.h"

namespace tenter::app {

namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
/// Stands in where nobody said what the cloth weighs.
constexpr double kUnknownDensity_kg_per_m2 = 0.2;

struct Options {
  std::string session, images, calibration, roi, output, report, fabric, specimen;
  std::vector<std::string> cameras;
  int subset_px = 31, order = 2, vertices = 100, threads = 0;
  double min_zncc = 0.75, max_sigma_px = 0.1, max_residual_px = 0.5;
  double areal_density_kg_per_m2 = 0.0;
};

void declare(CLI::App& command, Options& o) {
  command.add_option("session", o.session, "Recorded session with images");
  command.add_option("--images", o.images,
                     "Images of one's own, such as 'DIR/{camera}_{frame:04}.tif'");
  command.add_option("--calibration", o.calibration, "Of the cameras that took --images");
  command.add_option("--camera", o.cameras,
                     "NAME or NAME=TEXT: camera of the calibration, and what stands for {camera} "
                     "in its files; default: all");
  command.add_option("--roi", o.roi, "X,Y,WIDTH,HEIGHT in the first camera's first image [px]");
  command.add_option("--vertices", o.vertices, "Of the mesh, along its longer side")
      ->check(CLI::Range(3, 1000))
      ->capture_default_str();
  command.add_option("--subset", o.subset_px, "Side of a square subset [px], odd")
      ->capture_default_str();
  command.add_option("--order", o.order, "Of a subset's motion: 1 affine, 2 quadratic")
      ->capture_default_str();
  command.add_option("--min-zncc", o.min_zncc, "Least correlation of a valid vertex")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_option("--max-sigma-px", o.max_sigma_px, "Largest sigma of a valid match [px]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      .add_option("--max-residual-px", o.max_residual_px,
                  "How far views may disagree about a valid vertex [px]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_option("--fabric", o.fabric, "Name for the measurement, with --images");
  command.add_option("--specimen", o.specimen, "Which piece of it, with --images");
  command
      .add_option("--areal-density-kg-per-m2", o.areal_density_kg_per_m2,
                  "Mass of a square metre, with --images")
      ->check(CLI::Range(0.005, 5.0));
  command.add_option("--threads", o.threads, "0: one a core")->check(CLI::Range(0, 256));
  command.add_option("--report", o.report, "Page to write on how good it is (HTML)");
  command.add_option("-o,--output", o.output, "Measurement to write (folder)")->required();
}

SurfaceOptions surfaceOptions(const Options& o) {
  SurfaceOptions options;
  options.correlate.match.subset_px = o.subset_px;
  options.correlate.match.order = o.order;
  options.correlate.min_zncc = o.min_zncc;
  options.correlate.max_sigma_px = o.max_sigma_px;
  const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  options.correlate.threads = o.threads > 0 ? o.threads : cores;
  options.max_residual_px = o.max_residual_px;
  options.vertices_per_side = o.vertices;
  return options;
}

struct Roi {
  Vec2 least, most;
};

Result<std::optional<Roi>> parseRoi(const std::string& text) {
  if (text.empty()) return std::optional<Roi>();
  std::array<double, 4> numbers{};
  const char *at = text.data(), *end = text.data() + text.size();
  bool good = true;
  for (std::size_t k = 0; k < numbers.size() && good; ++k) {
    if (k > 0) good = at != end && *at++ == ',';
    if (!good) break;
    const auto [next, error] = std::from_chars(at, end, numbers[k]);
    good = error == std::errc() && std::isfinite(numbers[k]);
    at = next;
  }
  if (!good || at != end || !(numbers[2] > 0.0) || !(numbers[3] > 0.0)) {
    return usageError("--roi: '" + text + "' is not understood",
                      "X,Y,WIDTH,HEIGHT in pixels, such as 200,150,800,600");
  }
  const Vec2 corner(numbers[0], numbers[1]);
  return std::optional<Roi>(Roi{corner, corner + Vec2(numbers[2], numbers[3])});
}

struct Source {
  CameraView view;
  std::string token;  ///< Stands for {camera}.
};

/// Cameras of the calibration that take part.
Result<std::vector<Source>> sourcesOf(const CameraCalibration& calibration, const Options& o) {
  std::vector<Source> sources;
  const std::vector<CameraView> views = viewsOf(calibration);
  if (o.cameras.empty()) {
    for (const CameraView& view : views) sources.push_back({view, view.name});
  }
  std::set<std::string> used;
  for (const std::string& text : o.cameras) {
    const auto equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const auto view = std::find_if(views.begin(), views.end(),
                                   [&](const CameraView& v) { return v.name == name; });
    if (view == views.end()) {
      return usageError("--camera: the calibration has no camera '" + name + "'");
    }
    if (!used.insert(name).second) return usageError("--camera: '" + name + "' is given twice");
    sources.push_back({*view, equals == std::string::npos ? name : text.substr(equals + 1)});
  }
  if (sources.size() < 2) {
    return usageError("a surface takes at least two cameras",
                      "give a calibration of two cameras or more, and images of each");
  }
  return sources;
}

/// Sets of images by their number. The first must have an image of every camera.
Result<std::vector<ImageSet>> findSets(const std::vector<Source>& sources, const Options& o) {
  std::map<int, ImageSet> by_number;
  for (std::size_t v = 0; v < sources.size(); ++v) {
    const auto files = findImages(o.images, sources[v].token, "frame");
    if (!files) {
      Error error = files.error();
      error.reason += " for camera '" + sources[v].view.name + "'";
      return error;
    }
    for (const auto& [number, file] : *files) {
      ImageSet& set = by_number[number];
      set.files.resize(sources.size());
      set.files[v] = file;
    }
  }
  std::vector<ImageSet> sets;
  const int first = by_number.begin()->first;
  for (auto& [number, set] : by_number) {
    set.number = number;
    set.time_ns = (number - first) * kNanosecondsPerSecond;
    sets.push_back(std::move(set));
  }
  const auto missing = std::find(sets.front().files.begin(), sets.front().files.end(), "");
  if (missing != sets.front().files.end()) {
    const auto v = static_cast<std::size_t>(missing - sets.front().files.begin());
    return badInput(o.images, "frame " + std::to_string(first),
                    "there is no image of camera '" + sources[v].view.name + "'",
                    "the first frame is the reference and needs all cameras");
  }
  return sets;
}

double medianSigma(const Measurement& m) {
  std::vector<double> sigmas;
  for (const MeasurementFrame& frame : m.frames) {
    for (std::size_t i = 0; i < frame.valid.size(); ++i) {
      if (frame.valid[i] != 0)
        sigmas.push_back(frame.position_sigma_m(static_cast<Eigen::Index>(i)));
    }
  }
  if (sigmas.empty()) return 0.0;
  const auto middle = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2);
  std::nth_element(sigmas.begin(), middle, sigmas.end());
  return *middle;
}

void summarise(const Measurement& m, const std::vector<FrameQuality>& quality,
               const std::vector<std::string>& warnings, Console& console) {
  const auto vertices = static_cast<double>(m.rest->vertexCount());
  double valid = 0.0, seconds = 0.0;
  for (const FrameQuality& frame : quality) {
    valid += static_cast<double>(frame.valid);
    seconds += frame.seconds;
  }
  const double count = static_cast<double>(quality.size());
  const double fraction = valid / (vertices * count), sigma_m = medianSigma(m);
  console.answer = {{"frames", m.frames.size()},  {"vertices", m.rest->vertexCount()},
                    {"valid_fraction", fraction}, {"seconds_per_frame", seconds / count},
                    {"sigma_median_m", sigma_m},  {"warnings", warnings}};
  char line[160];
  std::snprintf(line, sizeof line, "%s of %d vertices, %.2f %% valid, %.2f s a frame",
                counted(m.frames.size(), "frame").c_str(), m.rest->vertexCount(), 100.0 * fraction,
                seconds / count);
  console.say(line);
  std::snprintf(line, sizeof line, "median sigma %.4f mm", 1e3 * sigma_m);
  console.say(line);
  for (const std::string& warning : warnings) console.warn(warning);
}

/// Beside the measurement: where frames are kept until all of them are done.
std::filesystem::path partialFolder(const Options& o) {
  std::filesystem::path folder = std::filesystem::path(o.output).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  folder += ".partial";
  return folder;
}

bool show(Progress& progress, int done, int count) {
  progress.show(static_cast<double>(done) / count,
                "frame " + std::to_string(done) + " of " + std::to_string(count));
  return !interrupted();
}

/// Writes the measurement and says what it is worth.
Result<int> finish(SeriesResult& result, const CameraView& view, const FrameImageReader& image,
                   const Options& o, Console& console) {
  for (const FrameQuality& frame : result.quality) {
    for (const std::string& warning : frame.warnings) {
      result.warnings.push_back("frame " + std::to_string(frame.number) + ": " + warning);
    }
  }
  if (auto done = writeMeasurement(o.output, result.measurement); !done) return done.error();
  if (!o.report.empty()) {
    const std::string page = qualityReport(result, view, image);
    if (auto done = writeFileAtomically(o.report, page); !done) return done.error();
  }
  summarise(result.measurement, result.quality, result.warnings, console);
  if (result.stopped) {
    return notConverged("stopped by the user", "the frames so far were written");
  }
  return kDone;
}

Result<int> runImages(const Options& o, Console& console) {
  if (o.calibration.empty()) return usageError("--images needs --calibration");
  const auto roi = parseRoi(o.roi);
  if (!roi) return roi.error();
  const auto calibration = readCalibration(o.calibration);
  if (!calibration) return calibration.error();
  const auto sources = sourcesOf(*calibration, o);
  if (!sources) return sources.error();
  const auto sets = findSets(*sources, o);
  if (!sets) return sets.error();
  std::vector<CameraView> views;
  for (const Source& source : *sources) views.push_back(source.view);
  Progress progress(console);
  SeriesOptions options;
  options.surface = surfaceOptions(o);
  options.calibration = &*calibration;
  if (*roi) {
    options.inside = [region = **roi](const Vec2& pixel) {
      return (pixel.array() >= region.least.array()).all() &&
             (pixel.array() <= region.most.array()).all();
    };
  }
  options.keep_going = [&](int done, int count) { return show(progress, done, count); };
  auto result = reconstructImages(views, *sets, options);
  if (!result) return result.error().file.empty() ? result.error().in(o.images) : result.error();
  Measurement& m = result->measurement;
  m.fabric = o.fabric;
  m.specimen = o.specimen;
  if (calibration->rig) {
    m.gravity_m_per_s2 =
        calibration->rig->rig_from_world.linear() * calibration->rig->gravity_world_m_per_s2;
  } else {
    m.gravity_m_per_s2 = Vec3::Zero();
    result->warnings.push_back(
        "the calibration does not say where gravity points: it is written as 0");
  }
  m.areal_density_kg_per_m2 = o.areal_density_kg_per_m2;
  if (!(m.areal_density_kg_per_m2 > 0.0)) {
    m.areal_density_kg_per_m2 = kUnknownDensity_kg_per_m2;
    result->warnings.push_back(
        "--areal-density-kg-per-m2 was not given: 0.2 kg/m^2 stands in for it");
  }
  const auto image = [&](std::size_t frame) -> GrayImage {
    const auto& file = (*sets)[frame].files.front();
    auto read = file.empty() ? Result<ImageFile>(ImageFile{}) : readGrayImage(file);
    return read ? std::move(read->image) : GrayImage{};
  };
  return finish(*result, views.front(), image, o, console);
}

Result<int> runSession(const Options& o, Console& console) {
  const auto session = openImageSession(o.session);
  if (!session) return session.error();
  Progress progress(console);
  SessionReconstruction options;
  options.surface = surfaceOptions(o);
  options.partial = partialFolder(o);
  options.keep_going = [&](int done, int count) { return show(progress, done, count); };
  auto result = reconstructSession(*session, options);
  if (!result) return result.error();
  result->warnings.insert(result->warnings.begin(), session->warnings.begin(),
                          session->warnings.end());
  const auto image = [&](std::size_t frame) {
    return pictureOf(*session, result->quality[frame].number);
  };
  const auto done = finish(*result, session->views.front(), image, o, console);
  if (done) discardPartial(options.partial);
  return done;
}

Result<int> run(const Options& o, Console& console) {
  if (o.session.empty() == o.images.empty()) {
    return usageError("give either a session or --images with --calibration");
  }
  if (auto usable = checkMatchOptions(surfaceOptions(o).correlate.match); !usable) {
    return usable.error();
  }
  if (auto free = checkOutputFolder(o.output, measurementFolder()); !free) return free.error();
  if (!o.report.empty()) {
    if (auto free = checkOutputFile(o.report, "<html"); !free) return free.error();
  }
  return o.session.empty() ? runImages(o, console) : runSession(o, console);
}

}  // namespace

Verb reconstructVerb() {
  return {"reconstruct", "Images of two or more cameras to a measurement",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
