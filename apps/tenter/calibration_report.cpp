// SPDX-License-Identifier: GPL-3.0-or-later
#include "calibration_report.h"

#include <cstdio>

namespace tenter::app {

namespace {

using nlohmann::json;

json orNull(const std::optional<double>& value) { return value ? json(*value) : json(nullptr); }

template <class... Values>
std::string text(const char* format, Values... values) {
  char buffer[400];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

json cameraAnswer(const CalibratedCamera& camera) {
  const Lens& lens = camera.model.lens();
  json answer = {{"name", camera.name},
                 {"rms_px", orNull(camera.rms_px)},
                 {"accepted", camera.used.size()},
                 {"rejected", rejectedJson(camera.rejected)},
                 {"alone_rms_px", orNull(camera.alone_rms_px)},
                 {"width_px", camera.model.widthPx()},
                 {"height_px", camera.model.heightPx()},
                 {"fx_px", lens.fx_px},
                 {"fy_px", lens.fy_px},
                 {"cx_px", lens.cx_px},
                 {"cy_px", lens.cy_px}};
  if (!camera.lens_sigma.empty()) answer["fx_sigma_px"] = camera.lens_sigma[0];
  return answer;
}

void sayCamera(const CalibratedCamera& camera, const Console& console) {
  const Lens& lens = camera.model.lens();
  std::string line = text("%s: %d x %d px, f %.2f, %.2f px", camera.name.c_str(),
                          camera.model.widthPx(), camera.model.heightPx(), lens.fx_px, lens.fy_px);
  if (!camera.lens_sigma.empty()) line += text(" (+- %.2g)", camera.lens_sigma[0]);
  if (camera.rms_px) {
    line += text(", %zu images, %.3f px RMS", camera.used.size(), *camera.rms_px);
  }
  console.say(line);
}

void sayQuality(const CameraCalibration& c, const Console& console) {
  const CalibrationQuality& q = c.quality;
  if (q.stereo_rms_px) {
    console.say(text("together: %.3f px RMS, baseline %.3f mm", *q.stereo_rms_px,
                     1e3 * baseline_m(c.cameras[0], c.cameras[1])));
  }
  if (q.held_out_rms_px) console.say(text("held-out boards: %.3f px RMS", *q.held_out_rms_px));
  if (q.distance_rms_m) {
    console.say(text("held-out known distances: %.4f mm RMS, %.4f mm at most; epipolar %.3f px RMS",
                     1e3 * *q.distance_rms_m, 1e3 * *q.distance_max_m, *q.epipolar_rms_px));
  }
  if (c.warp_m) {
    console.say(text("board's warp: %.3f, %.3f mm", 1e3 * c.warp_m->x(), 1e3 * c.warp_m->y()));
  }
}

}  // namespace

json rejectedJson(const std::vector<RejectedImage>& rejected) {
  json rows = json::array();
  for (const RejectedImage& image : rejected) {
    rows.push_back({{"image", image.image}, {"reason", image.reason}});
  }
  return rows;
}

void warnOfRejected(const std::vector<RejectedImage>& rejected, const Console& console) {
  for (const RejectedImage& image : rejected) {
    console.warn(image.image + ": left out: " + image.reason);
  }
}

void reportCalibration(const CameraCalibration& c, const std::string& file, Console& console) {
  auto& cameras = console.answer["cameras"] = json::array();
  for (const CalibratedCamera& camera : c.cameras) {
    cameras.push_back(cameraAnswer(camera));
    warnOfRejected(camera.rejected, console);
    sayCamera(camera, console);
  }
  sayQuality(c, console);
  const CalibrationQuality& q = c.quality;
  console.answer["stereo_rms_px"] = orNull(q.stereo_rms_px);
  console.answer["baseline_m"] =
      c.cameras.size() > 1 ? json(baseline_m(c.cameras[0], c.cameras[1])) : json(nullptr);
  console.answer["verdict"] = c.accepted ? "accepted" : "rejected";
  console.answer["reasons"] = c.reasons;
  console.answer["warnings"] = c.warnings;
  console.answer["held_out_rms_px"] = orNull(q.held_out_rms_px);
  console.answer["epipolar_rms_px"] = orNull(q.epipolar_rms_px);
  console.answer["distance_rms_m"] = orNull(q.distance_rms_m);
  console.answer["distance_max_m"] = orNull(q.distance_max_m);
  console.answer["calibration"] = file;
  for (const std::string& warning : c.warnings) console.warn(warning);
  for (const std::string& reason : c.reasons) Console::complain(reason);
  console.say(file + (c.accepted ? ": accepted" : ": rejected"));
}

}  // namespace tenter::app
