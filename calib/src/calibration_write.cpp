// SPDX-License-Identifier: GPL-3.0-or-later
#include <set>

#include "calibration_json.h"
#include "tenter/core/files.h"

namespace tenter {

namespace calibration_json {

using Json = nlohmann::ordered_json;

namespace {

template <class Vector>
Json listOf(const Vector& values) {
  Json list = Json::array();
  for (const auto& value : values) list.push_back(value);
  return list;
}

Json rowsOf(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    rows.push_back(listOf(Eigen::VectorXd(matrix.row(i).transpose())));
  }
  return rows;
}

Json poseJson(const Eigen::Isometry3d& pose) {
  return {{"rotation", rowsOf(pose.linear())}, {"translation_m", listOf(Vec3(pose.translation()))}};
}

Json orNull(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json boardJson(const CameraCalibration& c) {
  if (!c.board) return nullptr;
  Json board = {{"kind", nameOf(c.board->kind)},
                {"columns", c.board->columns},
                {"rows", c.board->rows},
                {"square_m", c.board->square_m}};
  if (c.board->kind == Board::Kind::kCharuco) {
    board["marker_m"] = c.board->marker_m;
    board["dictionary"] = c.board->dictionary;
  }
  if (c.warp_m) board["warp_m"] = listOf(*c.warp_m);
  if (c.warp_sigma_m) board["warp_sigma_m"] = listOf(*c.warp_sigma_m);
  return board;
}

Json cameraJson(const CalibratedCamera& camera) {
  const Lens& lens = camera.model.lens();
  Json used = Json::array(), rejected = Json::array();
  for (const UsedImage& image : camera.used) {
    used.push_back({{"image", image.image},
                    {"index", image.index},
                    {"corners", image.corners},
                    {"rms_px", image.rms_px}});
  }
  for (const RejectedImage& image : camera.rejected) {
    rejected.push_back({{"image", image.image}, {"reason", image.reason}});
  }
  Json json = {{"name", camera.name},
               {"width_px", camera.model.widthPx()},
               {"height_px", camera.model.heightPx()},
               {"fx_px", lens.fx_px},
               {"fy_px", lens.fy_px},
               {"cx_px", lens.cx_px},
               {"cy_px", lens.cy_px},
               {"distortion", listOf(lens.distortion)},
               {"camera_from_world", poseJson(camera.camera_from_world)},
               {"rms_px", orNull(camera.rms_px)},
               {"alone_rms_px", orNull(camera.alone_rms_px)},
               {"used", std::move(used)},
               {"rejected", std::move(rejected)}};
  if (!camera.lens_sigma.empty()) {
    json["lens_sigma"] = listOf(camera.lens_sigma);
    json["rotation_sigma_rad"] = listOf(camera.rotation_sigma_rad);
    json["translation_sigma_m"] = listOf(camera.translation_sigma_m);
  }
  return json;
}

Json qualityJson(const CalibrationQuality& q) {
  return {{"rms_px", orNull(q.rms_px)},
          {"stereo_rms_px", orNull(q.stereo_rms_px)},
          {"noise_px", orNull(q.noise_px)},
          {"held_out_rms_px", orNull(q.held_out_rms_px)},
          {"epipolar_rms_px", orNull(q.epipolar_rms_px)},
          {"distance_rms_m", orNull(q.distance_rms_m)},
          {"distance_max_m", orNull(q.distance_max_m)}};
}

}  // namespace

Json encode(const CameraCalibration& c) {
  Json cameras = Json::array();
  for (const CalibratedCamera& camera : c.cameras) cameras.push_back(cameraJson(camera));
  Json json = {{"format", kFormat},
               {"schema_version", kCalibrationSchemaVersion},
               {"units", kUnits},
               {"source", c.source},
               {"verdict", c.accepted ? kAccepted : kRejected},
               {"reasons", listOf(c.reasons)},
               {"warnings", listOf(c.warnings)},
               {"board", boardJson(c)},
               {"cameras", std::move(cameras)},
               {"quality", qualityJson(c.quality)}};
  if (c.rig) {
    json["rig"] = {{"rig_from_world", poseJson(c.rig->rig_from_world)},
                   {"gravity_world_m_per_s2", listOf(c.rig->gravity_world_m_per_s2)}};
  }
  if (c.covariance.size() > 0) {
    json["covariance"] = {{"parameters", listOf(c.parameters)}, {"matrix", rowsOf(c.covariance)}};
  }
  return json;
}

}  // namespace calibration_json

const CalibratedCamera* CameraCalibration::find(const std::string& name) const {
  for (const CalibratedCamera& camera : cameras) {
    if (camera.name == name) return &camera;
  }
  return nullptr;
}

double baseline_m(const CalibratedCamera& a, const CalibratedCamera& b) {
  return (a.camera_from_world.inverse().translation() - b.camera_from_world.inverse().translation())
      .norm();
}

std::string calibrationText(const CameraCalibration& c) {
  std::set<std::string> names;
  for (const CalibratedCamera& camera : c.cameras) names.insert(camera.name);
  require(!names.empty() && names.size() == c.cameras.size(), "cameras have names of their own");
  const auto replace = nlohmann::ordered_json::error_handler_t::replace;
  return calibration_json::encode(c).dump(1, ' ', false, replace) + "\n";
}

Result<void> writeCalibration(const std::filesystem::path& file, const CameraCalibration& c) {
  return writeFileAtomically(file, calibrationText(c));
}

}  // namespace tenter
