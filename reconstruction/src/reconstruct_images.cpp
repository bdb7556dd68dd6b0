// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/reconstruct_images.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "tenter/core/median.h"

namespace tenter {

namespace {

double sigmaOf(const Mat3& covariance) { return std::sqrt(covariance.trace() / 3.0); }

std::size_t imagesIn(const ImageSet& set) {
  return static_cast<std::size_t>(std::count_if(set.files.begin(), set.files.end(),
                                                [](const auto& file) { return !file.empty(); }));
}

/// Files that lack an image, by the names of their cameras.
std::string missingViews(const std::vector<CameraView>& views, const ImageSet& set) {
  std::string names;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (set.files[v].empty()) names += (names.empty() ? "" : ", ") + views[v].name;
  }
  return names;
}

Measurement emptyMeasurement(const RestSurface& rest) {
  Measurement m;
  m.protocol = "images";
  m.rest = rest.mesh;
  m.sample_size_m = rest.mesh.uv.rowwise().maxCoeff() - rest.mesh.uv.rowwise().minCoeff();
  return m;
}

}  // namespace

Result<std::vector<GrayImage>> readImageSet(const std::vector<CameraView>& views,
                                            const ImageSet& set,
                                            std::vector<std::string>& warnings) {
  std::vector<GrayImage> images(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (set.files[v].empty()) continue;
    auto file = readGrayImage(set.files[v]);
    if (!file) return file.error();
    const CameraModel& model = views[v].model;
    if (file->image.width != model.widthPx() || file->image.height != model.heightPx()) {
      return badInput(
          set.files[v].string(), "",
          "has " + std::to_string(file->image.width) + " x " + std::to_string(file->image.height) +
              " pixels, but camera '" + views[v].name + "' was calibrated with " +
              std::to_string(model.widthPx()) + " x " + std::to_string(model.heightPx()),
          "give the images that the calibration belongs to, uncropped");
    }
    for (const std::string& warning : file->warnings) {
      warnings.push_back(set.files[v].filename().string() + ": " + warning);
    }
    images[v] = std::move(file->image);
  }
  return images;
}

MeasurementFrame measuredFrame(const ClothFrame& cloth, std::int64_t time_ns) {
  MeasurementFrame frame;
  frame.time_ns = time_ns;
  frame.positions = cloth.positions_m;
  frame.position_sigma_m.resize(cloth.positions_m.cols());
  frame.position_sigma_axes_m.resize(3, cloth.positions_m.cols());
  for (std::size_t i = 0; i < cloth.states.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    // A place whose uncertainty is not known is no measurement.
    const Mat3& covariance = cloth.covariances_m2[i];
    const bool known = covariance.allFinite() && covariance.diagonal().minCoeff() >= 0.0;
    frame.position_sigma_m(column) = known ? sigmaOf(covariance) : 0.0;
    frame.position_sigma_axes_m.col(column) =
        known ? Vec3(covariance.diagonal().cwiseSqrt()) : Vec3(Vec3::Zero());
    frame.valid.push_back(
        static_cast<std::uint8_t>(known && cloth.states[i] == PointState::kValid));
  }
  return frame;
}

void VertexMaps::add(const ClothFrame& cloth) {
  const std::size_t count = cloth.states.size();
  ++frames;
  valid.resize(count);
  for (auto* sums : {&zncc, &residual_px, &sigma_m}) sums->resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    // A vertex that a clip holds is not seen.
    if (cloth.states[i] != PointState::kValid || cloth.views[i] == 0) continue;
    ++valid[i];
    zncc[i] += cloth.zncc[i];
    residual_px[i] += cloth.residual_px[i];
    sigma_m[i] += sigmaOf(cloth.covariances_m2[i]);
  }
}

FrameQuality qualityOf(const ClothFrame& cloth) {
  FrameQuality quality;
  quality.states.resize(kPointStates);
  std::vector<double> sigmas;
  std::vector<float> zncc, residuals;
  for (std::size_t i = 0; i < cloth.states.size(); ++i) {
    ++quality.states[static_cast<std::size_t>(cloth.states[i])];
    if (cloth.states[i] != PointState::kValid) continue;
    sigmas.push_back(sigmaOf(cloth.covariances_m2[i]));
    zncc.push_back(cloth.zncc[i]);
    residuals.push_back(cloth.residual_px[i]);
  }
  quality.valid = sigmas.size();
  quality.sigma_median_m = medianOf(std::move(sigmas));
  quality.zncc_median = medianOf(std::move(zncc));
  quality.residual_median_px = medianOf(std::move(residuals));
  quality.filled_m = cloth.filled_m;
  quality.warnings = cloth.warnings;
  return quality;
}

Result<SeriesResult> reconstructImages(const std::vector<CameraView>& views,
                                       const std::vector<ImageSet>& sets,
                                       const SeriesOptions& options) {
  require(!sets.empty(), "a series has at least one set of images");
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::time_point since) {
    return std::chrono::duration<double>(Clock::now() - since).count();
  };
  const int count = static_cast<int>(sets.size());
  Clock::time_point begin = Clock::now();
  SeriesResult result;
  auto images = readImageSet(views, sets.front(), result.warnings);
  if (!images) return images.error();
  SurfaceOptions surface_options = options.surface;
  surface_options.correlate.keep_going = [&](double) {
    return !options.keep_going ||
           options.keep_going(static_cast<int>(result.quality.size()), count);
  };
  auto rest = findSurface(views, *images, surface_options, options.inside);
  if (!rest) return rest.error();
  result.rest = std::move(*rest);
  addSystematicError(options.calibration, views, result.rest);
  result.warnings.insert(result.warnings.end(), result.rest.warnings.begin(),
                         result.rest.warnings.end());
  result.measurement = emptyMeasurement(result.rest);
  const auto keep = [&](const ClothFrame& cloth, const ImageSet& set) {
    FrameQuality quality = qualityOf(cloth);
    quality.number = set.number;
    quality.time_ns = set.time_ns;
    quality.seconds = seconds(begin);
    result.quality.push_back(std::move(quality));
    result.maps.add(cloth);
    result.measurement.frames.push_back(measuredFrame(cloth, set.time_ns));
    begin = Clock::now();
  };
  keep(restFrame(result.rest), sets.front());
  auto tracker = ClothTracker::create(views, *images, result.rest, surface_options);
  if (!tracker) return tracker.error();
  for (int i = 1; i < count; ++i) {
    if (options.keep_going && !options.keep_going(i, count)) {
      result.stopped = true;
      return result;
    }
    std::vector<std::string> warnings;
    if (imagesIn(sets[i]) < views.size()) {
      warnings.push_back("no image of " + missingViews(views, sets[i]));
    }
    if (imagesIn(sets[i]) < 2) {
      MeasurementFrame unseen;
      unseen.time_ns = sets[i].time_ns;
      result.measurement.frames.push_back(std::move(unseen));
      FrameQuality nothing;
      nothing.number = sets[i].number;
      nothing.time_ns = sets[i].time_ns;
      nothing.warnings = std::move(warnings);
      result.quality.push_back(std::move(nothing));
      continue;
    }
    images = readImageSet(views, sets[i], warnings);
    if (!images) return images.error();
    auto cloth = tracker->track(*images);
    if (!cloth) {
      const auto view = std::find_if(views.begin(), views.end(), [&](const CameraView& v) {
        return v.name == cloth.error().place;
      });
      const auto which = static_cast<std::size_t>(view - views.begin());
      return which < sets[i].files.size() ? cloth.error().in(sets[i].files[which].string())
                                          : cloth.error();
    }
    cloth->warnings.insert(cloth->warnings.begin(), warnings.begin(), warnings.end());
    keep(*cloth, sets[i]);
  }
  return result;
}

}  // namespace tenter
