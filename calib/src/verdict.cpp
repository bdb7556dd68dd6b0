// SPDX-License-Identifier: GPL-3.0-or-later
#include "verdict.h"

#include <algorithm>
#include <cstdio>

namespace tenter {

namespace {

/// A focal length known to less than this: the board was not tilted, or hardly.
constexpr double kWorstFocal = 5e-3;
/// Of a camera's photos in which the board was found; when more are left out, the rest is no
/// sample.
constexpr double kMostLeftOut = 0.5;
/// Part of the image that the corners of all photos together should span.
constexpr double kWellCovered = 0.4;
/// Held-out boards that miss by so much more than fitted ones betray too few images.
constexpr double kOverfit = 1.5;

template <class... Values>
std::string text(const char* format, Values... values) {
  char buffer[300];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

/// Bounding box of all corners over the area of the image.
double coverage(const CameraPhotos& photos) {
  Vec2 low(1e9, 1e9), high(-1e9, -1e9);
  for (const BoardPhoto& photo : photos.photos) {
    low = low.cwiseMin(photo.corners.pixels.rowwise().minCoeff());
    high = high.cwiseMax(photo.corners.pixels.rowwise().maxCoeff());
  }
  return std::max(0.0, (high - low).prod()) /
         (static_cast<double>(photos.width_px) * photos.height_px);
}

void judgeCamera(const CalibratedCamera& camera, const CameraPhotos& photos, double max_rms_px,
                 CameraCalibration& c) {
  const char* name = camera.name.c_str();
  if (camera.rms_px && *camera.rms_px > max_rms_px) {
    c.reasons.push_back(text("%s: its corners miss the model by %.2f px RMS, more than %.2f px",
                             name, *camera.rms_px, max_rms_px));
  }
  const double found = static_cast<double>(photos.photos.size());
  const double kept = static_cast<double>(camera.used.size());
  if (kept < (1.0 - kMostLeftOut) * found) {
    c.reasons.push_back(text("%s: only %.0f of %.0f images with a board agree", name, kept, found));
  }
  if (!camera.lens_sigma.empty()) {
    const Lens& lens = camera.model.lens();
    const double focal =
        std::max(camera.lens_sigma[0] / lens.fx_px, camera.lens_sigma[1] / lens.fy_px);
    if (focal > kWorstFocal) {
      c.reasons.push_back(text("%s: its focal length is known to %.1f %% only; tilt the board more",
                               name, 100.0 * focal));
    }
  }
  if (const double part = coverage(photos); part < kWellCovered) {
    c.warnings.push_back(
        text("%s: the boards span %.0f %% of the image; distortion outside is guessed", name,
             100.0 * part));
  }
}

/// Distortion that turns back inside of the image gives no ray for some of its pixels.
void judgeCornersOfImage(const CalibratedCamera& camera, CameraCalibration& c) {
  const CameraModel& m = camera.model;
  for (const double x : {0.0, m.widthPx() - 1.0}) {
    for (const double y : {0.0, m.heightPx() - 1.0}) {
      if (m.normalized({x, y})) continue;
      c.warnings.push_back(camera.name +
                           ": the distortion has no inverse in a corner of the image");
      return;
    }
  }
}

}  // namespace

void judge(const std::vector<CameraPhotos>& photos, const CameraCalibrationOptions& options,
           CameraCalibration& c) {
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    judgeCamera(c.cameras[i], photos[i], options.max_rms_px, c);
    judgeCornersOfImage(c.cameras[i], c);
  }
  if (c.covariance.size() == 0) {
    c.reasons.emplace_back(
        "the images do not determine all of lenses and poses; take more, the board tilted each "
        "time");
  }
  const CalibrationQuality& q = c.quality;
  if (q.held_out_rms_px && *q.held_out_rms_px > options.max_rms_px) {
    c.reasons.push_back(text("boards that were held out miss by %.2f px RMS, more than %.2f px",
                             *q.held_out_rms_px, options.max_rms_px));
  } else if (q.held_out_rms_px && q.rms_px && *q.held_out_rms_px > kOverfit * *q.rms_px) {
    c.warnings.push_back(
        text("boards that were held out miss by %.2f px RMS, fitted ones by %.2f px:"
             " too few images",
             *q.held_out_rms_px, *q.rms_px));
  }
  if (!q.held_out_rms_px) {
    c.warnings.emplace_back("fewer than six sets: no board could be held out");
  }
  c.accepted = c.reasons.empty();
}

}  // namespace tenter
