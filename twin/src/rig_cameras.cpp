// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/rig_cameras.h"

#include <cmath>
#include <numbers>

#include "random_numbers.h"
#include "rig_setup.h"
#include "stated_covariance.h"
#include "tenter/twin/protocol.h"

namespace tenter {
namespace {

constexpr double kFullWidth_px = 1936.0, kFullHeight_px = 1216.0;
constexpr double kFocal_px = 4266.0;  // 25 mm over 5.86 micrometres
constexpr double kAperture_m = 0.025 / 16.0;
constexpr double kDistance_m = 0.58;
constexpr double kRadian = std::numbers::pi / 180.0;
constexpr double kElevation_rad = 58.0 * kRadian;
// Of the table tests: from straight ahead of what hangs, low, to the sides, high.
constexpr double kSideways_rad = 45.0 * kRadian;
constexpr double kLow_rad = 36.0 * kRadian, kHigh_rad = 52.0 * kRadian;
constexpr double kHangingPlace_m = 0.095, kHangingDepth_m = 0.025;

/// How lenses and places differ from the drawing, one standard deviation.
constexpr double kPlaceScatter_m = 0.003, kTurnScatter_rad = 0.5 * kRadian, kFocalScatter = 0.005;
constexpr double kCentreScatter = 0.004;  // of the width
constexpr double kK1 = -0.15, kK1Scatter = 0.01, kK2 = 0.10, kK2Scatter = 0.02,
                 kTangentialScatter = 2e-4;

/// How calibrations err, before they are scaled to what is asked for.
constexpr std::array<double, 9> kLensErrors = {0.4, 0.4, 0.3, 0.3, 5e-4, 3e-3, 1e-5, 1e-5, 0.0};
constexpr double kRotationError_rad = 4e-5, kTranslationError_m = 2e-5;

struct View {
  double azimuth_rad, elevation_rad;
};

View viewOf(const RigCameraOptions& o, bool hangs, int i) {
  if (!hangs) return {2.0 * i / o.count * std::numbers::pi, kElevation_rad};
  const double across = 2.0 * i / (o.count - 1) - 1.0;
  const double push = o.protocol == "bend-warp" ? 0.5 * std::numbers::pi : 0.0;
  return {push + kSideways_rad * across, kLow_rad + (kHigh_rad - kLow_rad) * std::abs(across)};
}

/// Upright, its axis through a point.
Eigen::Isometry3d lookingAt(const Vec3& from, const Vec3& to) {
  const Vec3 forward = (to - from).normalized();
  const Vec3 right = forward.cross(Vec3::UnitZ()).normalized();
  Eigen::Isometry3d rig_from_camera = Eigen::Isometry3d::Identity();
  rig_from_camera.linear() << right, forward.cross(right), forward;
  rig_from_camera.translation() = from;
  return rig_from_camera.inverse();
}

Mat3 turnBy(const Vec3& vector) {
  const double angle = vector.norm();
  if (angle == 0.0) return Mat3::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

void turn(Eigen::Isometry3d& pose, const Mat3& rotation) {
  pose.linear() =
      Eigen::Quaterniond(Mat3(rotation * pose.linear())).normalized().toRotationMatrix();
}

Lens lensOf(double scale, RandomNumbers& random) {
  Lens lens;
  lens.fx_px = kFocal_px * scale * (1.0 + kFocalScatter * random.normal());
  lens.fy_px = lens.fx_px;
  const double width = kFullWidth_px * scale, height = kFullHeight_px * scale;
  lens.cx_px = 0.5 * (width - 1.0) + kCentreScatter * width * random.normal();
  lens.cy_px = 0.5 * (height - 1.0) + kCentreScatter * width * random.normal();
  lens.distortion[0] = kK1 + kK1Scatter * random.normal();
  lens.distortion[1] = kK2 + kK2Scatter * random.normal();
  lens.distortion[2] = kTangentialScatter * random.normal();
  lens.distortion[3] = kTangentialScatter * random.normal();
  return lens;
}

/// A camera's errors, in units of their size.
struct CameraError {
  std::array<double, 9> lens{};
  Vec3 rotation = Vec3::Zero(), translation = Vec3::Zero();
};

CameraError drawError(RandomNumbers& random) {
  CameraError error;
  for (std::size_t i = 0; i < error.lens.size(); ++i)
    error.lens[i] = kLensErrors[i] * random.normal();
  error.rotation = kRotationError_rad * random.normal3();
  error.translation = kTranslationError_m * random.normal3();
  return error;
}

VirtualCamera mistaken(const VirtualCamera& truth, const CameraError& error, double factor) {
  VirtualCamera out = truth;
  Lens lens = truth.model.lens();
  const double pixels = factor * truth.model.widthPx() / kFullWidth_px;
  lens.fx_px += pixels * error.lens[0];
  lens.fy_px += pixels * error.lens[1];
  lens.cx_px += pixels * error.lens[2];
  lens.cy_px += pixels * error.lens[3];
  for (std::size_t i = 0; i < 5; ++i) lens.distortion[i] += factor * error.lens[i + 4];
  // Errors are far too small to make a lens invalid.
  out.model = *CameraModel::make(truth.model.widthPx(), truth.model.heightPx(), lens);
  turn(out.camera_from_rig, turnBy(factor * error.rotation));
  out.camera_from_rig.translation() += factor * error.translation;
  return out;
}

/// Root mean square over a cube of the sample's size.
double distance_px(const VirtualCamera& a, const VirtualCamera& b, const Vec3& focus) {
  constexpr int kPlaces = 5;
  double squares = 0.0;
  int seen = 0;
  for (int i = 0; i < kPlaces * kPlaces * kPlaces; ++i) {
    const Vec3 cell(i % kPlaces, i / kPlaces % kPlaces, i / (kPlaces * kPlaces));
    const Vec3 place = focus + kSampleSide_m * (cell / (kPlaces - 1.0) - Vec3::Constant(0.5));
    const auto pa = a.model.project(a.camera_from_rig * place);
    const auto pb = b.model.project(b.camera_from_rig * place);
    if (!pa || !pb) continue;
    squares += (*pa - *pb).squaredNorm();
    ++seen;
  }
  return seen > 0 ? std::sqrt(squares / seen) : 0.0;
}

}  // namespace

Vec3 rigFocus(std::string_view protocol) {
  const auto known = findProtocol(protocol);
  const double middle = 0.5 * kSampleSide_m;
  if (!known || (*known)->has_cords) return {middle, middle, 0.0};
  return protocol == "bend-warp" ? Vec3(middle, kHangingPlace_m, -kHangingDepth_m)
                                 : Vec3(kHangingPlace_m, middle, -kHangingDepth_m);
}

Result<std::vector<VirtualCamera>> rigCameras(const RigCameraOptions& o) {
  const auto protocol = findProtocol(o.protocol);
  if (!protocol) return protocol.error();
  if (o.count < 2 || o.count > 8) return usageError("the virtual rig has 2 to 8 cameras");
  if (o.width_px < 320 || o.width_px > 4096) {
    return usageError("images of the virtual rig are 320 to 4096 pixels wide");
  }
  const double scale = o.width_px / kFullWidth_px;
  const Vec3 focus = rigFocus(o.protocol);
  RandomNumbers random(o.seed, "cameras " + o.protocol);
  std::vector<VirtualCamera> cameras;
  for (int i = 0; i < o.count; ++i) {
    const View view = viewOf(o, !(*protocol)->has_cords, i);
    const double level = std::cos(view.elevation_rad);
    const Vec3 direction(level * std::cos(view.azimuth_rad), level * std::sin(view.azimuth_rad),
                         std::sin(view.elevation_rad));
    const Vec3 place = focus + kDistance_m * direction + kPlaceScatter_m * random.normal3();
    Eigen::Isometry3d pose = lookingAt(place, focus);
    // About its own centre: the whole pose turns, translation included.
    pose = turnBy(kTurnScatter_rad * random.normal3()) * pose;
    auto model = CameraModel::make(
        o.width_px, static_cast<int>(std::lround(kFullHeight_px * scale)), lensOf(scale, random));
    if (!model) return model.error();
    cameras.push_back({"cam-" + std::to_string(i + 1), *std::move(model), pose, kAperture_m,
                       (focus - place).norm(), 1.0});
  }
  return cameras;
}

CameraCalibration calibrationOf(const std::vector<VirtualCamera>& cameras, const Vec3& focus,
                                double error_px, std::uint64_t seed) {
  require(!cameras.empty() && error_px >= 0.0, "calibrationOf: cameras, and an error of 0 or more");
  RandomNumbers random(seed, "calibration");
  CameraCalibration out;
  out.source = "tenter twin";
  Eigen::Isometry3d rig_from_world = Eigen::Isometry3d::Identity();
  std::vector<StatedError> stated;
  for (const VirtualCamera& truth : cameras) {
    const CameraError error = drawError(random);
    const double whole_px = distance_px(truth, mistaken(truth, error, 1.0), focus);
    const double factor = whole_px > 0.0 ? error_px / whole_px : 0.0;
    const VirtualCamera seen = mistaken(truth, error, factor);
    if (out.cameras.empty()) rig_from_world = seen.camera_from_rig.inverse();
    CalibratedCamera camera{truth.name, seen.model, seen.camera_from_rig * rig_from_world};
    if (out.cameras.empty()) camera.camera_from_world.setIdentity();
    StatedError own{seen.camera_from_rig, kLensErrors, factor * kRotationError_rad,
                    factor * kTranslationError_m};
    const double pixels = truth.model.widthPx() / kFullWidth_px;
    for (std::size_t i = 0; i < own.lens.size(); ++i)
      own.lens[i] *= factor * (i < 4 ? pixels : 1.0);
    stated.push_back(own);
    if (factor > 0.0) {
      camera.lens_sigma.assign(own.lens.begin(), own.lens.end());
      const double moved = out.cameras.empty() ? 0.0 : factor;  // the first one is the world
      camera.rotation_sigma_rad.setConstant(moved * kRotationError_rad);
      camera.translation_sigma_m.setConstant(moved * kTranslationError_m);
    }
    out.cameras.push_back(std::move(camera));
  }
  stateCovariance(stated, out);
  out.quality.rms_px = error_px;
  out.rig = RigFrame{rig_from_world, rig_from_world.linear().transpose() * kDefaultGravity};
  return out;
}

}  // namespace tenter
