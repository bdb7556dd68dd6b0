// SPDX-License-Identifier: GPL-3.0-or-later
// What a calibration errs by, against triangulations with a calibration that errs.
#include "tenter/reconstruction/systematic_error.h"

#include <gtest/gtest.h>

#include <string>

namespace tenter {
namespace {

constexpr std::size_t kPose = 9;  ///< Terms of a lens before a pose.

Eigen::Isometry3d lookingDownFrom(const Vec3& centre) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const Vec3 forward = -centre.normalized();
  const Vec3 right = Vec3::UnitY().cross(forward).normalized();
  pose.linear().row(0) = right;
  pose.linear().row(1) = forward.cross(right);
  pose.linear().row(2) = forward;
  pose.translation() = -pose.linear() * centre;
  return pose;
}

/// Three cameras and a rig that is turned and moved in their world.
CameraCalibration calibration() {
  CameraCalibration c;
  const Lens lens{1500.0, 1510.0, 480.0, 360.0, {-0.1, 0.05, 1e-3, -5e-4, 0.01}};
  const auto model = CameraModel::make(960, 720, lens);
  const std::vector<Vec3> centres{{-0.2, 0.0, 0.5}, {0.2, 0.05, 0.5}, {0.0, -0.2, 0.55}};
  const Eigen::Isometry3d world = lookingDownFrom(centres[0]);
  const char* names[] = {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"};
  for (std::size_t i = 0; i < centres.size(); ++i) {
    const std::string name = "cam-" + std::to_string(i);
    c.cameras.push_back({name, *model, lookingDownFrom(centres[i]) * world.inverse()});
    for (const char* term : names) c.parameters.push_back(name + "." + term);
    for (int axis = 0; axis < 6 && i > 0; ++axis)
      c.parameters.push_back(name + (axis < 3 ? ".rotation_rad[" : ".translation_m[") +
                             std::to_string(axis % 3) + "]");
  }
  for (int axis = 0; axis < 6; ++axis)
    c.parameters.push_back(std::string(axis < 3 ? "rig.rotation_rad[" : "rig.translation_m[") +
                           std::to_string(axis % 3) + "]");
  Eigen::Isometry3d rig_from_world = world.inverse();
  rig_from_world.prerotate(Eigen::AngleAxisd(0.1, Vec3(1.0, 2.0, 0.5).normalized()));
  rig_from_world.pretranslate(Vec3(0.01, -0.02, 0.005));
  c.rig = RigFrame{rig_from_world, Vec3::Zero()};
  c.covariance.setZero(static_cast<Eigen::Index>(c.parameters.size()),
                       static_cast<Eigen::Index>(c.parameters.size()));
  return c;
}

Eigen::Isometry3d moved(const Eigen::Isometry3d& pose, int axis, double by) {
  Eigen::Isometry3d out = pose;
  if (axis >= 3)
    out.translation()[axis - 3] += by;
  else
    out.linear() = Eigen::AngleAxisd(by, Vec3::Unit(axis)) * pose.linear();
  return out;
}

/// The calibration with one of its parameters off by so much.
CameraCalibration erring(const CameraCalibration& c, Eigen::Index parameter, double by) {
  CameraCalibration out = c;
  std::size_t camera = 0, term = static_cast<std::size_t>(parameter);
  while (camera < out.cameras.size() && term >= (camera > 0 ? kPose + 6 : kPose))
    term -= camera++ > 0 ? kPose + 6 : kPose;
  if (camera == out.cameras.size()) {
    out.rig->rig_from_world =
        moved(c.rig->rig_from_world.inverse(), static_cast<int>(term), by).inverse();
    return out;
  }
  CalibratedCamera& changed = out.cameras[camera];
  if (term >= kPose) {
    changed.camera_from_world =
        moved(changed.camera_from_world, static_cast<int>(term - kPose), by);
    return out;
  }
  Lens lens = changed.model.lens();
  double* terms[] = {&lens.fx_px, &lens.fy_px, &lens.cx_px, &lens.cy_px};
  (term < 4 ? *terms[term] : lens.distortion[term - 4]) += by;
  changed.model = *CameraModel::make(960, 720, lens);
  return out;
}

TEST(SystematicErrorTest, IsWhatATriangulationWithAnErringCalibrationMissesBy) {
  const CameraCalibration exact = calibration();
  const std::vector<CameraView> views = viewsOf(exact);
  const Vec3 point = exact.rig->rig_from_world * Vec3(0.03, -0.02, 0.53);
  std::vector<Sighting> seen;
  for (int v = 0; v < 3; ++v) {
    const auto pixel = views[v].project(point);
    ASSERT_TRUE(pixel);
    Mat2 covariance;
    covariance << 0.01 * (v + 1), 0.002, 0.002, 0.02;
    seen.push_back({v, *pixel, covariance});
  }
  for (Eigen::Index p = 0; p < exact.covariance.rows(); ++p) {
    // Lens terms of the order of a pixel, poses of 0.1 mrad and 0.1 mm.
    const double sigma = exact.parameters[p].ends_with("_px") ? 0.3 : 1e-4;
    CameraCalibration known = exact;
    known.covariance(p, p) = sigma * sigma;
    const auto error = SystematicError::ofCalibration(known, views);
    ASSERT_TRUE(error);
    const auto found = triangulate(viewsOf(erring(exact, p, sigma)), seen);
    ASSERT_TRUE(found);
    const Vec3 missed = found->position_m - point;
    const Mat3 expected = missed * missed.transpose();
    EXPECT_LT((error->covarianceAt(point, seen) - expected).norm(), 0.02 * expected.norm())
        << exact.parameters[p];
  }
}

TEST(SystematicErrorTest, IsNotKnownWithoutACovariance) {
  CameraCalibration c = calibration();
  c.parameters.clear();
  c.covariance.resize(0, 0);
  EXPECT_FALSE(SystematicError::ofCalibration(c, viewsOf(c)));
}

}  // namespace
}  // namespace tenter
