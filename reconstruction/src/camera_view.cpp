// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/camera_view.h"

namespace tenter {

std::optional<Vec2> CameraView::project(const Vec3& point_m,
                                        Eigen::Matrix<double, 2, 3>* jacobian) const {
  const auto pixel = model.project(camera_from_space * point_m, jacobian);
  if (pixel && jacobian) *jacobian = *jacobian * camera_from_space.linear();
  return pixel;
}

std::optional<Vec3> CameraView::direction(const Vec2& pixel) const {
  const auto place = model.normalized(pixel);
  if (!place) return std::nullopt;
  return Vec3(camera_from_space.linear().transpose() *
              Vec3(place->x(), place->y(), 1.0).normalized());
}

std::vector<CameraView> viewsOf(const CameraCalibration& calibration) {
  std::vector<CameraView> views;
  for (const CalibratedCamera& camera : calibration.cameras) {
    Eigen::Isometry3d pose = camera.camera_from_world;
    if (calibration.rig) pose = pose * calibration.rig->rig_from_world.inverse();
    views.push_back({camera.name, camera.model, pose});
  }
  return views;
}

}  // namespace tenter
