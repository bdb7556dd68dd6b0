// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <set>

#include "calibration_json.h"
#include "tenter/core/json_reader.h"

namespace tenter {

namespace calibration_json {

namespace {

using Range = JsonReader::Range;

constexpr double kMaxLength_m = 1e4;

Eigen::Isometry3d readPose(JsonReader in) {
  constexpr double kRotationTolerance = 1e-6;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const Mat3 rotation = in.matrix("rotation", 3, 3);
  const Vec3 translation = in.vector("translation_m", 3);
  if (!in.ok()) return pose;
  const bool orthonormal =
      (rotation * rotation.transpose() - Mat3::Identity()).norm() < kRotationTolerance;
  if (!orthonormal || rotation.determinant() < 0.0) in.fail("rotation", "is not a rotation");
  if (!(translation.norm() < kMaxLength_m)) {
    in.fail("translation_m", "is longer than 10 km", "check the unit");
  }
  pose.linear() = rotation;
  pose.translation() = translation;
  return pose;
}

std::optional<double> numberOrNull(JsonReader& in, const std::string& key) {
  if (!in.has(key) || in.json().at(key).is_null()) return std::nullopt;
  return in.number(key, Range::nonNegative());
}

void readBoard(JsonReader& document, CameraCalibration& c) {
  if (!document.has("board") || document.json().at("board").is_null()) return;
  JsonReader in = document.object("board");
  Board board;
  const auto kind = boardKind(in.text("kind"));
  if (!kind) in.fail("kind", kind.error().reason);
  if (kind.ok()) board.kind = *kind;
  board.columns = static_cast<int>(in.integer("columns", 2, 100));
  board.rows = static_cast<int>(in.integer("rows", 2, 100));
  board.square_m = in.number("square_m", Range::positive(1.0));
  if (board.kind == Board::Kind::kCharuco) {
    board.marker_m = in.number("marker_m", Range::positive(1.0));
    board.dictionary = in.text("dictionary");
  }
  if (in.has("warp_m")) c.warp_m = Vec2(in.vector("warp_m", 2));
  if (in.has("warp_sigma_m")) c.warp_sigma_m = Vec2(in.vector("warp_sigma_m", 2));
  if (!in.ok()) return;
  if (const auto valid = validateBoard(board); !valid) {
    in.fail(valid.error().place, valid.error().reason);
  }
  c.board = board;
}

void readImages(JsonReader& in, CalibratedCamera& camera) {
  for (std::size_t i = 0; in.has("used") && i < in.arraySize("used") && in.ok(); ++i) {
    JsonReader row = in.element("used", i);
    camera.used.push_back({row.text("image"), static_cast<int>(row.integer("index", 0, 999999999)),
                           static_cast<int>(row.integer("corners", 0, 10000)),
                           row.number("rms_px", Range::nonNegative())});
  }
  for (std::size_t i = 0; in.has("rejected") && i < in.arraySize("rejected") && in.ok(); ++i) {
    JsonReader row = in.element("rejected", i);
    camera.rejected.push_back({row.text("image"), row.text("reason")});
  }
}

void readSigmas(JsonReader& in, CalibratedCamera& camera) {
  if (!in.has("lens_sigma")) return;
  camera.lens_sigma = in.numbers("lens_sigma", Range::nonNegative());
  if (in.ok() && camera.lens_sigma.size() != 9) in.fail("lens_sigma", "must have 9 numbers");
  camera.rotation_sigma_rad = in.vector("rotation_sigma_rad", 3);
  camera.translation_sigma_m = in.vector("translation_sigma_m", 3);
}

void readCamera(JsonReader in, CameraCalibration& c) {
  const std::string name = in.text("name", 200);
  const int width = static_cast<int>(in.integer("width_px", 1, 65536));
  const int height = static_cast<int>(in.integer("height_px", 1, 65536));
  Lens lens{in.number("fx_px"), in.number("fy_px"), in.number("cx_px"), in.number("cy_px"), {}};
  const Eigen::VectorXd distortion = in.vector("distortion", kDistortionTerms);
  for (int i = 0; i < kDistortionTerms; ++i) lens.distortion[i] = distortion[i];
  const Eigen::Isometry3d pose = readPose(in.object("camera_from_world"));
  if (name.empty()) in.fail("name", "is empty");
  if (c.find(name) != nullptr) in.fail("name", "'" + name + "' is the name of two cameras");
  if (!in.ok()) return;
  const auto model = CameraModel::make(width, height, lens);
  if (!model) {
    in.fail(model.error().place, model.error().reason);
    return;
  }
  CalibratedCamera camera{name, *model, pose};
  camera.rms_px = numberOrNull(in, "rms_px");
  camera.alone_rms_px = numberOrNull(in, "alone_rms_px");
  readSigmas(in, camera);
  readImages(in, camera);
  c.cameras.push_back(std::move(camera));
}

void readQuality(JsonReader in, CalibrationQuality& q) {
  q.rms_px = numberOrNull(in, "rms_px");
  q.stereo_rms_px = numberOrNull(in, "stereo_rms_px");
  q.noise_px = numberOrNull(in, "noise_px");
  q.held_out_rms_px = numberOrNull(in, "held_out_rms_px");
  q.epipolar_rms_px = numberOrNull(in, "epipolar_rms_px");
  q.distance_rms_m = numberOrNull(in, "distance_rms_m");
  q.distance_max_m = numberOrNull(in, "distance_max_m");
}

void readCovariance(JsonReader in, CameraCalibration& c) {
  c.parameters = in.texts("parameters");
  const int size = static_cast<int>(c.parameters.size());
  c.covariance = in.matrix("matrix", size, size);
  if (!in.ok() || size == 0) return;
  const double largest = c.covariance.cwiseAbs().maxCoeff();
  if (!((c.covariance - c.covariance.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * largest)) {
    in.fail("matrix", "is not symmetric");
  }
  if (!(c.covariance.diagonal().minCoeff() >= 0.0)) in.fail("matrix", "has a negative variance");
}

}  // namespace

Result<CameraCalibration> decode(const nlohmann::json& document, const std::string& file) {
  JsonReader in(document, file);
  CameraCalibration c;
  if (in.ok() && in.text("format") != kFormat) {
    in.fail("format", "must be \"" + std::string(kFormat) + "\"",
            "tenter calibrate import reads files of other programs");
  }
  if (in.ok() && in.integer("schema_version", 1, INT32_MAX) > kCalibrationSchemaVersion) {
    in.fail("schema_version", "is newer than this program", "use a newer tenter");
  }
  if (in.ok() && in.text("units") != kUnits) in.fail("units", "must be \"SI\"");
  c.source = in.text("source");
  const std::string verdict = in.text("verdict");
  if (verdict != kAccepted && verdict != kRejected) {
    in.fail("verdict", "must be accepted or rejected");
  }
  c.accepted = verdict == kAccepted;
  if (in.has("reasons")) c.reasons = in.texts("reasons");
  if (in.has("warnings")) c.warnings = in.texts("warnings");
  readBoard(in, c);
  const std::size_t cameras = in.arraySize("cameras");
  if (in.ok() && (cameras == 0 || cameras > kMaxCameras)) in.fail("cameras", "must be 1 to 64");
  for (std::size_t i = 0; i < cameras && in.ok(); ++i) readCamera(in.element("cameras", i), c);
  if (in.has("quality")) readQuality(in.object("quality"), c.quality);
  if (in.has("rig")) {
    JsonReader rig = in.object("rig");
    c.rig = RigFrame{readPose(rig.object("rig_from_world")),
                     Vec3(rig.vector("gravity_world_m_per_s2", 3))};
  }
  if (in.has("covariance")) readCovariance(in.object("covariance"), c);
  if (!in.ok()) return in.error();
  return c;
}

}  // namespace calibration_json

Result<CameraCalibration> readCalibration(const std::filesystem::path& file, bool also_rejected) {
  const auto document = readJsonFile(file);
  if (!document) return document.error();
  auto calibration = calibration_json::decode(*document, file.string());
  if (!calibration || calibration->accepted || also_rejected) return calibration;
  Error error =
      badInput(file.string(), "verdict",
               "this calibration was rejected" +
                   (calibration->reasons.empty() ? "" : ": " + calibration->reasons.front()),
               "take new images of the board");
  error.kind = ErrorKind::kCalibrationRejected;
  return error;
}

}  // namespace tenter
