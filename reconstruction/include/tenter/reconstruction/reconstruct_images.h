// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tenter/core/measurement.h"
#include "tenter/reconstruction/cloth_tracker.h"

namespace tenter {

/// Images of one moment: a file for each view, an empty path where there is none.
struct ImageSet {
  std::int64_t time_ns = 0;
  int number = 0;
  std::vector<std::filesystem::path> files;
};

/// How well one frame was seen.
struct FrameQuality {
  int number = 0;
  std::int64_t time_ns = 0;
  std::size_t valid = 0;
  std::vector<std::size_t> states;  ///< Count of vertices by PointState.
  double sigma_median_m = 0.0, zncc_median = 0.0, residual_median_px = 0.0;
  double filled_m = 0.0;
  double seconds = 0.0;
  std::vector<std::string> warnings;
};

/// How well each vertex was seen, over all frames.
struct VertexMaps {
  int frames = 0;
  std::vector<int> valid;  ///< In how many frames.
  /// Sums over those.
  std::vector<double> zncc, residual_px, sigma_m;

  void add(const ClothFrame& cloth);
};

/// Images to follow cloth through, and how.
struct SeriesOptions {
  SurfaceOptions surface;
  /// Where the views come from; its covariance becomes part of sigma.
  const CameraCalibration* calibration = nullptr;
  /// Pixels of the first view's first image that count; empty: all.
  std::function<bool(const Vec2&)> inside;
  /// Asked between frames and within them: frames done, frames in all; false stops.
  std::function<bool(int, int)> keep_going;
};

/// What came out of a series: a measurement without clips, and how good it is.
struct SeriesResult {
  Measurement measurement;
  RestSurface rest;
  std::vector<FrameQuality> quality;  ///< One a frame of the measurement.
  VertexMaps maps;
  std::vector<std::string> warnings;
  bool stopped = false;  ///< Frames after the last one were not looked at.
};

/// Shape and displacement of cloth from images of two or more calibrated cameras: the first set is
/// the reference and the first frame. Fabric, specimen and areal density are the caller's to fill
/// in. A set in which fewer than two views have an image becomes a frame without a mesh. Error: the
/// first set cannot be reconstructed, an image cannot be read or has another size than its camera.
Result<SeriesResult> reconstructImages(const std::vector<CameraView>& views,
                                       const std::vector<ImageSet>& sets,
                                       const SeriesOptions& options);

/// A frame of a measurement from what was seen. A vertex whose covariance is not finite, or is
/// negative on an axis, is not valid.
MeasurementFrame measuredFrame(const ClothFrame& cloth, std::int64_t time_ns);

/// Its figures.
FrameQuality qualityOf(const ClothFrame& cloth);

/// Reads the images of a set; what is missing stays empty. Error, naming the file: not readable, or
/// of another size than its camera's.
Result<std::vector<GrayImage>> readImageSet(const std::vector<CameraView>& views,
                                            const ImageSet& set,
                                            std::vector<std::string>& warnings);

}  // namespace tenter
