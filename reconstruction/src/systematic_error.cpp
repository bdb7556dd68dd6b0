// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/reconstruction/systematic_error.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <string>

#include "tenter/calib/calibration_parameters.h"
#include "tenter/core/cross_matrix.h"

namespace tenter {

namespace {

/// Of a term's standard deviation, for central differences.
constexpr double kStep = 0.1;

double& lensTerm(Lens& lens, int term) {
  switch (term) {
    case 0:
      return lens.fx_px;
    case 1:
      return lens.fy_px;
    case 2:
      return lens.cx_px;
    case 3:
      return lens.cy_px;
    default:
      return lens.distortion[static_cast<std::size_t>(term - 4)];
  }
}

/// First of the rows that are named "of.term" in order, searched from the end if `last`; -1: none.
template <std::size_t count>
Eigen::Index rowsOf(const std::vector<std::string>& names, const std::string& of,
                    const std::array<const char*, count>& terms, bool last = false) {
  std::vector<std::string> wanted;
  nameParameters(of, terms, wanted);
  const auto found = last ? std::find_end(names.begin(), names.end(), wanted.begin(), wanted.end())
                          : std::search(names.begin(), names.end(), wanted.begin(), wanted.end());
  return found == names.end() ? -1 : static_cast<Eigen::Index>(found - names.begin());
}

}  // namespace

std::optional<SystematicError> SystematicError::ofCalibration(
    const CameraCalibration& calibration, const std::vector<CameraView>& views) {
  const auto size = static_cast<Eigen::Index>(calibration.parameters.size());
  if (size == 0 || calibration.covariance.rows() != size) return std::nullopt;
  SystematicError error;
  error.covariance_ = calibration.covariance;
  for (const CameraView& view : views) {
    const CalibratedCamera* camera = calibration.find(view.name);
    if (camera == nullptr) return std::nullopt;
    View out(view);
    out.camera_from_world = camera->camera_from_world;
    out.lens = rowsOf(calibration.parameters, view.name, kLensParameters);
    if (out.lens < 0) return std::nullopt;
    if (camera != &calibration.cameras.front()) {
      out.pose = rowsOf(calibration.parameters, view.name, kPoseParameters);
      if (out.pose < 0) return std::nullopt;
    }
    for (int term = 0; term < kLensTerms; ++term) {
      const double sigma = std::sqrt(calibration.covariance(out.lens + term, out.lens + term));
      const double step = kStep * sigma;
      Lens up = camera->model.lens(), down = up;
      lensTerm(up, term) += step;
      lensTerm(down, term) -= step;
      const auto more = CameraModel::make(camera->model.widthPx(), camera->model.heightPx(), up);
      const auto less = CameraModel::make(camera->model.widthPx(), camera->model.heightPx(), down);
      if (!more || !less) return std::nullopt;
      out.more.push_back(*more);
      out.less.push_back(*less);
      out.step.push_back(step);
    }
    error.views_.push_back(std::move(out));
  }
  if (calibration.rig) {
    error.world_from_rig_ = calibration.rig->rig_from_world.inverse();
    // The last of that name: a camera may be called so too.
    error.rig_ = rowsOf(calibration.parameters, std::string(kRigPose), kPoseParameters, true);
  }
  return error;
}

SystematicError SystematicError::ofOffsets(const std::vector<CameraView>& views, double offset_px) {
  SystematicError error;
  const auto size = static_cast<Eigen::Index>(2 * views.size());
  error.covariance_ = offset_px * offset_px * Eigen::MatrixXd::Identity(size, size);
  for (const CameraView& view : views) {
    View out(view);
    out.offset = static_cast<Eigen::Index>(2 * error.views_.size());
    error.views_.push_back(std::move(out));
  }
  return error;
}

bool SystematicError::pixelByParameters(const View& view, const Vec3& point_m,
                                        PixelRows& rows) const {
  rows.setZero(2, covariance_.rows());
  if (view.offset >= 0) rows.middleCols<2>(view.offset).setIdentity();
  if (view.lens < 0) return true;
  const Vec3 world = world_from_rig_ ? *world_from_rig_ * point_m : point_m;
  const Vec3 local = view.camera_from_world * world;
  Eigen::Matrix<double, 2, 3> jacobian;
  if (!view.view.model.project(local, &jacobian)) return false;
  for (int term = 0; term < kLensTerms; ++term) {
    const auto at = static_cast<std::size_t>(term);
    if (view.step[at] == 0.0) continue;
    const auto more = view.more[at].project(local), less = view.less[at].project(local);
    if (!more || !less) return false;
    rows.col(view.lens + term) = (*more - *less) / (2.0 * view.step[at]);
  }
  const Mat3 turn = view.camera_from_world.linear();
  if (view.pose >= 0) {
    rows.middleCols<3>(view.pose) = -jacobian * crossMatrix(turn * world);
    rows.middleCols<3>(view.pose + 3) = jacobian;
  }
  if (rig_ >= 0) {
    const Vec3 arm = world - world_from_rig_->translation();
    rows.middleCols<3>(rig_) = -jacobian * turn * crossMatrix(arm);
    rows.middleCols<3>(rig_ + 3) = jacobian * turn;
  }
  return true;
}

SystematicError::PlaceRows SystematicError::placeByParameters(
    const Vec3& point_m, std::span<const Sighting> sightings) const {
  Mat3 normal = Mat3::Zero();
  PlaceRows right = PlaceRows::Zero(3, covariance_.rows());
  PixelRows rows;
  for (const Sighting& seen : sightings) {
    const View& view = views_[static_cast<std::size_t>(seen.view)];
    Eigen::Matrix<double, 2, 3> jacobian;
    if (!view.view.project(point_m, &jacobian) || !pixelByParameters(view, point_m, rows))
      return PlaceRows::Zero(3, covariance_.rows());
    const Eigen::Matrix<double, 3, 2> weighted =
        jacobian.transpose() * seen.covariance_px2.inverse();
    normal += weighted * jacobian;
    right.noalias() -= weighted * rows;
  }
  const Eigen::LDLT<Mat3> factor(normal);
  if (sightings.size() < 2 || !factor.isPositive()) return PlaceRows::Zero(3, covariance_.rows());
  return factor.solve(right);
}

}  // namespace tenter
